"""Gymnasium environments of blind touch; importing this package registers them."""

from __future__ import annotations

from haptic_env.moved import moved
from haptic_env.registration import ENVIRONMENTS, EXPLORE, register
from haptic_env.unwrapping import HandEnv, hand_env, hand_of

register()
moved({"haptic_env.skeleton": ["haptic_env.hands.skeleton"]})

__all__ = ["ENVIRONMENTS", "EXPLORE", "HandEnv", "hand_env", "hand_of"]
