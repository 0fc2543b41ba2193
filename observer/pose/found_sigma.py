"""The σ of white noise that an observer finds out.

Shapes: H joints that are heard. Angles in radians.
"""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from observer.pose.angle_noise import GUESS_DEG


class FoundSigma:
    """σ of white noise as it is found out: an inverse gamma distribution of σ², the same for all joints, by variational
    Bayes (Särkkä & Nummenmaa 2009, IEEE Trans. Autom. Control 54(3), 596-600, without forgetting)."""

    def __init__(self) -> None:
        self.shape = 1.0
        self.rate = np.deg2rad(GUESS_DEG) ** 2

    def learn(self, residual: Array, variance: Array) -> None:
        """Take in a step.

        Args:
            residual: (H,) rad, felt less expected, after the step.
            variance: (H,) rad², what is uncertain of the expected, after the step.
        """
        self.shape += 0.5 * len(residual)
        self.rate += 0.5 * float((residual**2 + variance).sum())

    @property
    def sigma(self) -> float:
        """Rad: the present estimate."""
        return float(np.sqrt(self.rate / self.shape))
