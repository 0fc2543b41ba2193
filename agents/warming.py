"""What policies that look ahead need to have compiled (`observer.compiling`)."""

from __future__ import annotations

import gymnasium as gym

import haptic_env  # noqa: F401 - registers
from observer import HapticSLAM, ObserverWrapper, ShapePosterior


def looking_ahead() -> None:
    """`information_gain`, for names and for maps."""
    from agents.information_gain import OBJECTIVES, InformationGain

    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=1.0)
    hand = env.unwrapped.hand  # type: ignore[attr-defined]
    guided = ObserverWrapper(env, HapticSLAM(hand, particles=1), ShapePosterior(hand))
    observation, _ = guided.reset(seed=0)
    for objective in OBJECTIVES:
        InformationGain(guided, seed=0, objective=objective).predict(observation)
    guided.close()
