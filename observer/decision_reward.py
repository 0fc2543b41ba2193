"""Reward for coming to know the truth: for training alone, for it reads what no policy may."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from observer.belief_observation import labels_of
from observer.potential_reward import PotentialReward


class DecisionReward(PotentialReward, gym.utils.RecordConstructorArgs):
    """Reward of a step: what was gained in log p(truth), in nats, less `price` times the seconds that it took.

    A probability below `least` counts as `least`. At the end `info["is_success"]` (Stable-Baselines3's name for it)
    says whether the truth is the most probable. Reads `info["truth"]`: `env` needs `reveal_truth=True`.
    """

    def __init__(self, env: gym.Env[Any, Any], price: float = 0.25, least: float = 1e-3) -> None:
        """`price` in nats a second. Raises `ValueError` for a value out of range, or where nothing names the object."""
        gym.utils.RecordConstructorArgs.__init__(self, price=price, least=least)
        gym.Wrapper.__init__(self, env)
        base: Any = env.unwrapped
        if not getattr(base, "reveal_truth", False):
            raise ValueError("DecisionReward compares with the truth: make the environment with reveal_truth=True")
        self._least = validate.number("least", least, 0.0, 0.1, above=0.0)
        self._cost = validate.number("price", price, 0.0) / base.control_hz
        self._labels = labels_of(env)

    def potential(self, info: dict[str, Any]) -> float:
        """log p(truth), nats; raises `ValueError` where the truth is not among the labels."""
        return float(np.log(max(info["posterior"][self._truth(info)], self._least)))

    def step(self, action: NDArray[Any]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, gain, terminated, truncated, info = super().step(action)
        if terminated or truncated:
            info = {**info, "is_success": bool(np.argmax(info["posterior"]) == self._truth(info))}
        return observation, gain - self._cost, terminated, truncated, info

    def _truth(self, info: dict[str, Any]) -> int:
        return self._labels.index(validate.choice("label of the true shape", info["truth"]["shape"], self._labels))
