"""The configuration of one exploration: environment, object, sensor noise, particles, policy and seed, and their
defaults. It is checked when it is made, by the names of the flags of `haptic-slam explore`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import haptic_env
from haptic_env import shapes, validate
from haptic_lab.conditions import check_policy

OBSERVER, RAW = "haptic_slam", "floor"
SECONDS = 10.0
DEFAULTS: dict[str, Any] = {
    "env": "HapticSLAM/TwoFinger-v0",
    "shape": None,
    "scale": 1.0,
    "sigma": 3.0,
    "particles": 200,
    "seed": 0,
}


@dataclass(frozen=True)
class ExplorationSettings:
    """What the command line asks for.

    Attributes:
        env: id of the environment.
        shape: name, or path of a mesh; None: a hidden one.
        scale: metres that the unit of a mesh file is long.
        sigma: SD of the noise of felt angles, degrees.
        seconds: how long is explored; None: 10, or as long as the recording.
        particles: of the observer.
        policy: name, or path of a model.
        seed: of everything random.
        out: folder for the results.
        trust: whether a model may run code when it is read.

    Raises:
        ValueError: for a value out of its range.
    """

    env: str
    shape: str | None
    scale: float
    sigma: float
    seconds: float | None  # None: 10, or as long as the recording
    particles: int
    policy: str
    seed: int
    out: str
    trust: bool = False

    def __post_init__(self) -> None:
        validate.choice("--env", self.env, haptic_env.ENVIRONMENTS)
        if self.shape is not None:
            shapes.default_size(shapes.check("--shape", self.shape), self.scale)
        validate.number("--scale", self.scale, above=0.0, unit="m")
        validate.number("--sigma", self.sigma, 0.0, 90.0, unit="degrees")
        if self.seconds is not None:
            validate.number("--seconds", self.seconds, 0.0, 3600.0, above=0.0, unit="s")
        validate.integer("--particles", self.particles, 1, 100_000)
        check_policy(self.policy, self.trust)
        validate.integer("--seed", self.seed, 0, 2**32 - 1)
