"""What the particles need of whatever tracks the pose.

Shapes: J joints, P patches, D numbers of a joint Gaussian over the angles of now and of the past, and maybe more.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.pose.angle_noise import AngleNoise, Offset


class PoseSource(Protocol):
    """A Gaussian over the angles of several steps: the forward model's, the paper's, or the raw angles."""

    hand: Hand
    sigma: float
    """Rad: SD of the noise of the felt angles; may be set, from the next step on."""
    mean: Array
    """(D,); `mean[lagged(k)]` are the angles (J,) rad of k steps ago, `mean[:J]` those of now."""
    covariance: Array
    """(D, D), in the same order."""
    log_evidence: float
    """Log density of the angles felt so far."""

    @property
    def offset(self) -> Offset:
        """What is known of the offsets of the felt angles now."""

    noise: AngleNoise
    """What is wrong with the felt angles, beside white noise."""

    @property
    def constant(self) -> slice:
        """Where `mean` keeps the errors of the angles that never change; nowhere where it keeps none."""

    @property
    def learns(self) -> bool:
        """Whether what changes the Gaussian now is kept, and tells of offsets that it has."""

    @property
    def set_aside(self) -> NDArray[np.int64]:
        """(J,) how many readings of each joint were odd since the reset, so that they were set aside or taken without
        whole turns; where none was, nothing differs."""

    def reset(self, felt: Array | None = None) -> None:
        """Start at the rest pose, or, where the hand may be elsewhere, from the angles `felt` (J,) rad at first."""

    def step(self, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]) -> None:
        """Move on by one control step: `torque` (J,) fractions, felt `joint_angles` (J,) rad, `contacts` (P,)."""

    def lagged(self, steps: int) -> slice:
        """Where `mean` keeps the angles of `steps` steps ago, 0 being now."""
