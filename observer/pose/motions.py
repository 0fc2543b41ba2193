"""How the hand may be known to move: what tracks its pose, by name. Add one as a line of `MOTIONS`."""

from __future__ import annotations

from collections.abc import Callable

from observer.pose.delta_pose import DeltaPose
from observer.pose.kalman import PoseFilter
from observer.pose.raw_angles import RawAngles
from observer.pose.smooth_motion import KinematicPose
from observer.pose.source import PoseSource

MOTIONS: dict[str, Callable[..., PoseSource]] = {
    "forward_model": PoseFilter,
    "delta_pose": DeltaPose,
    "kinematic": KinematicPose,
    "raw_angles": RawAngles,
}
