"""Reward for knowing more, whatever the truth is."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from observer.belief_observation import labels_of
from observer.potential_reward import PotentialReward


class InformationGainReward(PotentialReward, gym.utils.RecordConstructorArgs):
    """Reward of a step: by how many bits the entropy has fallen, of the `objective`: the posterior over names, or the
    map, its voxels taken as independent. It needs no truth: a belief pays it to itself, also where it is wrong."""

    def __init__(self, env: gym.Env[Any, Any], objective: str = "class") -> None:
        """Raises `ValueError` for an unknown objective, or where nothing names the object."""
        gym.utils.RecordConstructorArgs.__init__(self, objective=objective)
        gym.Wrapper.__init__(self, env)
        self._objective = validate.choice("objective", objective, ("class", "map"))
        labels_of(env)

    def potential(self, info: dict[str, Any]) -> float:
        """Minus the entropy in bits."""
        if self._objective == "class":
            return float(_bits(info["posterior"]).sum())
        occupied = info["belief"].occupancy
        return float((_bits(occupied) + _bits(1.0 - occupied)).sum())


def _bits(probability: ArrayLike) -> NDArray[np.float64]:
    """p log2 p (...,) of `probability` (...,); 0 where it is 0."""
    p = np.asarray(probability, dtype=np.float64)
    return p * np.log2(np.where(p > 0.0, p, 1.0))
