"""Reward for knowing more, whatever the truth is."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from observer.belief_observation import labels_of

OBJECTIVES = ("name", "map")


def bits(probability: ArrayLike) -> float:
    """Entropy of independent voxels of `probability` (...,) to be occupied, in bits."""
    p = np.asarray(probability, dtype=np.float64)
    p = p[(p > 0.0) & (p < 1.0)]
    return float(-(p * np.log2(p) + (1.0 - p) * np.log2(1.0 - p)).sum())


class InformationGainReward(gym.Wrapper, gym.utils.RecordConstructorArgs):
    """Reward of a step: by how many bits the entropy has fallen, of the `objective`: the posterior over names, or the
    map, its voxels taken as independent. It needs no truth: a belief can pay it to itself, also where it is wrong."""

    def __init__(self, env: gym.Env[Any, Any], objective: str = "name") -> None:
        """Raises `ValueError` for an unknown objective, or where nothing names the object."""
        gym.utils.RecordConstructorArgs.__init__(self, objective=objective)
        gym.Wrapper.__init__(self, env)
        self._objective = validate.choice("objective", objective, OBJECTIVES)
        labels_of(env)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        self._before = self._entropy(info)
        return observation, info

    def step(self, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, _, terminated, truncated, info = self.env.step(action)
        now = self._entropy(info)
        gain, self._before = self._before - now, now
        return observation, gain, terminated, truncated, info

    def _entropy(self, info: dict[str, Any]) -> float:
        if self._objective == "map":
            return bits(info["belief"].occupancy)
        p = info["posterior"][info["posterior"] > 0.0]
        return float(-(p * np.log2(p)).sum())
