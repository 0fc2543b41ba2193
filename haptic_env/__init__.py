"""Gymnasium environments of blind touch; importing this package registers them."""

from __future__ import annotations

import gymnasium as gym

from haptic_env.moved import moved
from haptic_env.unwrapping import HandEnv, hand_env, hand_of

ENVIRONMENTS = {
    "HapticSLAM/TwoFinger-v0": "two_finger",
    "HapticSLAM/TwoFingerArm-v0": "two_finger_arm",
    "HapticSLAM/AdroitHand-v0": "adroit",
    "HapticSLAM/MyoHand-v0": "myo",
}

for _id, _hand in ENVIRONMENTS.items():
    if _id not in gym.registry:
        gym.register(_id, entry_point="haptic_env.explore:ExploreEnv", kwargs={"hand": _hand})

moved({"haptic_env.skeleton": ["haptic_env.hands.skeleton"]})

__all__ = ["ENVIRONMENTS", "HandEnv", "hand_env", "hand_of"]
