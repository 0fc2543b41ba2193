"""Recordings made for the tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from haptic_env import hands
from haptic_env.recordings import Recording, Track


def closing(frames: int = 40, **changes: Any) -> Recording:
    """Two fingers that close about an object, while both are carried about and turned together."""
    hand = hands.make("two_finger")
    share = np.linspace(0.0, 1.0, frames)[:, None]
    fist = hand.rest_pose + np.deg2rad([0, 60, 20, 10] * 2)
    turns = Rotation.from_rotvec(share * [0.3, -0.5, 0.8]).as_quat(scalar_first=True)
    track = Track(share * [0.2, 0.1, -0.3], turns)
    whole: dict[str, Any] = {
        "source": "closing",
        "time": 0.02 * np.arange(frames),
        "joint_names": hand.joint_names,
        "joint_angles": (1 - share) * hand.rest_pose + share * fist,
        "root": track,
        "object": track,
    }
    return Recording(**(whole | changes))
