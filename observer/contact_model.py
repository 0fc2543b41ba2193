"""What a touch and a silence say: the numbers of p(z | q, m)."""

from __future__ import annotations

from dataclasses import dataclass, fields

from haptic_env import validate
from observer.kernels import Evidence


@dataclass(frozen=True)
class ContactModel:
    """Sensor model of the patches against an occupancy grid: a noisy-OR over the cells at a patch (Pearl 1988).

    `hit`: probability that an occupied cell at the patch makes it ring. `false_alarm`: that it rings for none of
    them. `free`: weight of a silence, log-odds a step. `touch` and `sustained`: weight of a touch when it begins and at
    every step that it lasts, fractions of its log likelihood ratio: a lasting touch mostly repeats itself. `shell`: how far above the
    skin the centre of a touched cell may lie, in voxels, and `fall`: the SD of what lies beyond. `caution`: how deep in a link a cell must lie to be free, in
    SDs of the link's place. `temper`: the same discount for p(z | q, m) in matching and weighing.
    """

    hit: float = 0.15
    false_alarm: float = 0.05
    free: float = 1.0
    touch: float = 1.0
    sustained: float = 0.3
    shell: float = 0.75
    fall: float = 0.5
    caution: float = 2.0
    temper: float = 0.1

    def __post_init__(self) -> None:
        for field in fields(self):
            high = 1.0 if field.name in ("hit", "false_alarm", "temper") else 10.0
            validate.number(field.name, getattr(self, field.name), 0.0, high)
        if self.hit >= 1.0 or self.false_alarm <= 0.0 or self.fall <= 0.0:
            raise ValueError(
                f"hit must be below 1, false_alarm and fall above 0; got {self.hit}, {self.false_alarm}, {self.fall}"
            )

    def evidence(self, resolution: float) -> Evidence:
        """The same for the kernels, lengths in metres."""
        return Evidence(self.hit, self.false_alarm, self.free, self.shell * resolution, self.fall * resolution, self.temper)
