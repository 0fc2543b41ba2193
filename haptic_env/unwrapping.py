"""What any environment with a hand has, found beneath whatever is wrapped about it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, cast

import gymnasium as gym

if TYPE_CHECKING:
    from haptic_env.hand import Hand


class HandEnv(Protocol):
    """What may be known of an exploration beforehand: the `hand`, how often it is moved, and for how many steps."""

    hand: Hand
    control_hz: float
    episode_steps: int


def hand_env(env: gym.Env[Any, Any]) -> HandEnv:
    """The environment inside all wrappers of `env`; raises `ValueError` where that is none with a hand."""
    # Imported here: registering needs neither.
    from haptic_env import validate
    from haptic_env.hand import Hand

    base = env.unwrapped if isinstance(env, gym.Env) else None
    if not isinstance(getattr(base, "hand", None), Hand):
        shown = validate.shown(env)
        raise ValueError(f"env must be one environment with a hand, such as HapticSLAM/TwoFinger-v0, got {shown}")
    return cast("HandEnv", base)


def hand_of(env: gym.Env[Any, Any]) -> Hand:
    """The hand of `env`, however it is wrapped; raises `ValueError` where it has none."""
    return hand_env(env).hand
