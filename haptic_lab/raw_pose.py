"""Who names what is touched by angles that are taken at their word: the floor, and what quick training has.

Shapes: J joints.
"""

from __future__ import annotations

from typing import Any

from haptic_env.hand import Hand
from observer.pose.raw_angles import RawAngles
from observer.pose_only import PoseOnly


class RawPose(PoseOnly):
    """Takes felt angles at their word: names as `DeadReckoning` does."""

    def __init__(self, hand: Hand, sigma_deg: Any, **keywords: Any) -> None:
        """Take the keyword arguments of `PoseOnly`.

        Args:
            hand: with J joints.
            sigma_deg: degrees, SD of white noise of the felt angles; None: 3, as nothing tells of it.
            **keywords: what else `PoseOnly` is told.

        Raises:
            ValueError: for a value out of range.
        """
        super().__init__(hand, 3.0 if sigma_deg is None else sigma_deg, **keywords)
        self.lag = 0  # what is taken at its word waits for nothing
        sigma, noise = self.pose.sigma, self.pose.noise
        self.pose = RawAngles(hand, sigma=sigma, control_hz=self.control_hz, lag=self.stride, noise=noise)
