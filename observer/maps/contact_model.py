"""What a touch and a silence say: the numbers of p(z | q, m)."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy.special import expit, logit, ndtri_exp

from haptic_env import validate
from haptic_env.grid import LARGEST as LARGEST_VOXEL
from haptic_env.grid import SMALLEST as SMALLEST_VOXEL
from observer.maps.evidence import LIMIT, LOG_ODDS, QUANTUM, Evidence

SMALLEST = 1e-9  # weight of a sweep by which no cell loses anything


@dataclass(frozen=True)
class ContactModel:
    """Sensor model of the patches against an occupancy grid: a noisy-OR over the cells at a patch (Pearl 1988).

    `prior`: probability that a cell is occupied, of those whose centre the skin came within `near` voxels of and of
    their 26 neighbours; of the others nothing is said.

    Touch. `hit`: probability that an occupied cell at the patch makes it ring; `false_alarm`: that it rings for none.
    `touch` and `sustained`: weights of a touch when it begins and at every step that it lasts, as multiples of its log
    likelihood ratio: a lasting touch mostly repeats itself. `shell`: how far above the skin the centre of a touched
    cell may lie, in voxels; beyond that its part fades with an SD of `fall` voxels and of `blur` times the SD of the
    link's place. It lies at most `deep` voxels beneath: fingers press in, and voxels are coarse.

    Silence and sweeps. A cell inside a link is free unless the link is elsewhere: its log likelihood ratio is that of
    a normal distribution's tail at its depth less `give` voxels, with an SD of `edge` voxels and that of the link's
    place. `free`: weight of that at every step, for errors last.

    `caution`: how much of the SD of a link's place, given all that was felt, a map allows for; 0 holds the pose fixed
    as the paper does, which is right where particles carry the whole of it.

    `temper`: exponent of p(z | q, m) in matching and weighing, below 1 because successive steps are not independent.

    `repeats`: how long a map listens to a link that rests or comes back. What it has to say at one place is said after
    0.7 times so many steps; from then on neither its sweeps nor its touches change anything (`observer.novelty`). 0:
    every step counts.
    """

    prior: float = 0.03
    near: float = 0.87
    hit: float = 0.12
    false_alarm: float = 0.03
    touch: float = 1.6
    sustained: float = 0.4
    shell: float = 0.75
    fall: float = 0.3
    blur: float = 0.5
    deep: float = 0.4
    free: float = 0.07
    give: float = 0.3
    edge: float = 0.175
    caution: float = 1.0
    temper: float = 0.3
    repeats: float = 50.0

    def __post_init__(self) -> None:
        for field in fields(self):
            high = 1.0 if field.name in ("prior", "hit", "false_alarm", "temper") else 10.0
            high = 1e6 if field.name == "repeats" else high
            value = validate.number(field.name, getattr(self, field.name), 0.0, high)
            object.__setattr__(self, field.name, value)  # a float whatever was given: kernels are compiled for those
        if self.hit >= 1.0:
            raise ValueError(f"hit must be below 1, got {self.hit}")
        for name in ("prior", "false_alarm"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ValueError(f"{name} must lie strictly between 0 and 1, got {getattr(self, name)}")
        for name in ("fall", "edge"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"{name} must be above 0 voxels, got {getattr(self, name)}")

    def evidence(self, resolution: float) -> Evidence:
        """The same for the kernels, lengths in metres, of voxels of edge `resolution` m."""
        validate.number("resolution", resolution, SMALLEST_VOXEL, LARGEST_VOXEL, unit="m")
        probability = expit(LOG_ODDS + logit(self.prior))
        return Evidence(
            hit=self.hit,
            false_alarm=self.false_alarm,
            give=self.give * resolution,
            edge=self.edge * resolution,
            deep=self.deep * resolution,
            shell=self.shell * resolution,
            fall=self.fall * resolution,
            blur=self.blur,
            near=self.near * resolution,
            temper=self.temper,
            log_no_alarm=float(np.log1p(-self.false_alarm)),
            solid=int(np.searchsorted(probability, 0.5, side="right")) - 128,
            probability=probability,
            log_clear=np.log1p(-self.hit * probability),
            log_silent=np.log1p(-self.hit * np.maximum(0.0, 2.0 * probability - 1.0)),
            depth=ndtri_exp(-QUANTUM * (np.arange(1, LIMIT + 1) - 0.5) / max(self.free, SMALLEST)),
        )
