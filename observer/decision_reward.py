"""Reward for coming to know the truth: for training alone, for it reads what no policy may."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from observer.belief_observation import labels_of


class DecisionReward(gym.Wrapper, gym.utils.RecordConstructorArgs):
    """Reward of a step: what was gained in log p(truth), in nats, less `price` times the seconds that it took.

    Gains add up to log p(truth) at the end less that at the start, whatever the path (Ng, Harada & Russell 1999, ICML:
    potential-based), so that an episode is worth what it ends with, but the learner hears of it at once. A
    probability below `least` counts as `least`. At the end `info["is_success"]` (Stable-Baselines3's name for it) says
    whether the truth is the most probable. Reads `info["truth"]`: `env` needs `reveal_truth=True`.
    """

    def __init__(self, env: gym.Env[Any, Any], price: float = 0.25, least: float = 1e-3) -> None:
        """`price` in nats a second. Raises `ValueError` for a value out of range, or where nothing names the object."""
        gym.utils.RecordConstructorArgs.__init__(self, price=price, least=least)
        gym.Wrapper.__init__(self, env)
        base: Any = env.unwrapped
        if not base.reveal_truth:
            raise ValueError("DecisionReward compares with the truth: make the environment with reveal_truth=True")
        self._least = validate.number("least", least, 0.0, 0.1, above=0.0)
        self._cost = validate.number("price", price, 0.0) / base.control_hz
        self._labels = labels_of(env)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        truth = validate.choice("true shape, not among the labels:", info["truth"]["shape"], self._labels)
        self._truth = self._labels.index(truth)
        self._before = self._log(info)
        return observation, info

    def step(self, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, _, terminated, truncated, info = self.env.step(action)
        now = self._log(info)
        gain, self._before = now - self._before, now
        if terminated or truncated:
            info = {**info, "is_success": bool(np.argmax(info["posterior"]) == self._truth)}
        return observation, gain - self._cost, terminated, truncated, info

    def _log(self, info: dict[str, Any]) -> float:
        return float(np.log(max(info["posterior"][self._truth], self._least)))
