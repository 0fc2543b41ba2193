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
    """A Gaussian over the angles of several steps: the forward model's, the paper's, or the raw angles.

    Attributes:
        hand: with J joints and P patches.
        sigma: rad, SD of white noise of the felt angles; may be set, from the next step on.
        mean: (D,), `mean[lagged(k)]` being the angles (J,) rad of k steps ago, `mean[:J]` those of now.
        covariance: (D, D), in the same order.
        log_evidence: log density of the angles felt so far.
        noise: what is wrong with the felt angles, beside white noise.
        needs_torque: whether `step` asks what was commanded.
    """

    hand: Hand
    sigma: float | Array
    mean: Array
    covariance: Array
    log_evidence: float
    noise: AngleNoise
    needs_torque: bool

    @property
    def offset(self) -> Offset:
        """What is known of the offsets of the felt angles now."""

    @property
    def constant(self) -> slice:
        """Where `mean` keeps the errors of the angles that never change; nowhere where it keeps none."""

    @property
    def unfound(self) -> Array:
        """(J,) rad²: variance of constant errors that nothing finds out, so that a map has them too; (0,): of none."""

    @property
    def learns(self) -> bool:
        """Whether what changes the Gaussian now is kept, and tells of offsets that it has."""

    @property
    def set_aside(self) -> NDArray[np.int64]:
        """(J,) how many odd readings of each joint were set aside since the reset, or taken without whole turns.

        Where there was none, nothing differs.
        """

    def reset(self, felt: Array | None = None) -> None:
        """Start a trial at the rest pose.

        Args:
            felt: (J,) rad, the angles felt there, from which to start where the hand may be elsewhere.
        """

    def step(self, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]) -> None:
        """Move on by one control step.

        Args:
            torque: (J,) that was commanded, fractions of the limits.
            joint_angles: (J,) rad that were felt after it.
            contacts: (P,) that were felt.
        """

    def lagged(self, steps: int) -> slice:
        """Tell where `mean` keeps the angles of a step.

        Args:
            steps: how many ago, 0 being now.

        Returns:
            J numbers.
        """
