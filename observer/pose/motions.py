"""How the hand may be known to move: what tracks its pose, by name. Add one as a line of `MOTIONS`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from haptic_env.hand import Hand
from observer.pose.coupled_motion import CoupledKinematicPose
from observer.pose.delta_pose import DeltaPose
from observer.pose.kalman import PoseFilter
from observer.pose.raw_angles import RawAngles
from observer.pose.smooth_motion import KinematicPose
from observer.pose.source import PoseSource


def smooth_motion(hand: Hand, **keywords: Any) -> KinematicPose:
    """Follow joints that move smoothly.

    Args:
        hand: whose joints they are.
        **keywords: those of `KinematicPose`.

    Returns:
        What does, and knows which joints follow others.
    """
    return (CoupledKinematicPose if hand.couplings else KinematicPose)(hand, **keywords)


MOTIONS: dict[str, Callable[..., PoseSource]] = {
    "forward_model": PoseFilter,
    "delta_pose": DeltaPose,
    "kinematic": smooth_motion,
    "raw_angles": RawAngles,
}
