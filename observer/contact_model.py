"""What a touch and a silence say: the numbers of p(z | q, m)."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from haptic_env import validate
from observer.kernels import PROBABILITY, Evidence


@dataclass(frozen=True)
class ContactModel:
    """Sensor model of the patches against an occupancy grid: a noisy-OR over the cells at a patch (Pearl 1988).

    `hit`: probability that an occupied cell at the patch makes it ring; `false_alarm`: that it rings for none.
    `free`: weight of a silence, log-odds a step. `touch` and `sustained`: weights of a touch when it begins and at
    every step that it lasts, fractions of its log likelihood ratio: a lasting touch mostly repeats itself.
    `least`: log likelihood ratio below which a touch, having many suspects, says nothing of any of them. `shell`:
    how far above the skin the centre of a touched cell may lie, in voxels, and `fall`: the SD of what lies beyond.
    `caution`: how deep in a link a cell must lie to be free, in SDs of the link's place. `temper`: exponent of
    p(z | q, m) in matching and weighing, below 1 because successive steps are not independent.
    """

    hit: float = 0.15
    false_alarm: float = 0.05
    free: float = 1.0
    touch: float = 1.0
    sustained: float = 0.3
    least: float = 0.15
    shell: float = 0.75
    fall: float = 0.5
    caution: float = 2.0
    temper: float = 0.1

    def __post_init__(self) -> None:
        for field in fields(self):
            high = 1.0 if field.name in ("hit", "false_alarm", "temper") else 10.0
            validate.number(field.name, getattr(self, field.name), 0.0, high)
        if self.hit >= 1.0:
            raise ValueError(f"hit must be below 1, got {self.hit}")
        if not 0.0 < self.false_alarm < 1.0:
            raise ValueError(f"false_alarm must lie strictly between 0 and 1, got {self.false_alarm}")
        if self.fall <= 0.0:
            raise ValueError(f"fall must be above 0 voxels, got {self.fall}")

    def evidence(self, resolution: float) -> Evidence:
        """The same for the kernels, lengths in metres."""
        known = np.maximum(0.0, 2.0 * PROBABILITY - 1.0)
        return Evidence(
            hit=self.hit,
            false_alarm=self.false_alarm,
            free=self.free,
            least=self.least,
            shell=self.shell * resolution,
            fall=self.fall * resolution,
            temper=self.temper,
            log_no_alarm=float(np.log1p(-self.false_alarm)),
            log_clear=np.log1p(-self.hit * PROBABILITY),
            log_silent=np.log1p(-self.hit * known),
        )
