"""The sweep that was made by hand (`agents.sweep`), as a learner copies it before it learns."""

from __future__ import annotations

from dataclasses import dataclass

from agents import sweep
from haptic_env import validate


@dataclass(frozen=True)
class SweepingMotion(sweep.SweepingMotion):
    """`agents.sweep.SweepingMotion`, and how it is copied.

    Attributes:
        noise: SD of what is added while it is copied, so that it is seen what to do beside its path.
        decisions: of each environment that are copied.
        epochs: of the fit.

    Raises:
        ValueError: for a value out of its range.
    """

    noise: float = 0.3
    decisions: int = 150
    epochs: int = 60

    def __post_init__(self) -> None:
        super().__post_init__()
        validate.number("noise", self.noise, 0.0, 10.0)
        validate.integer("decisions", self.decisions, 1, 1_000_000)
        validate.integer("epochs", self.epochs, 0, 1_000_000)
