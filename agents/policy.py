"""What a policy is: Stable-Baselines3's `predict`, so that trained models and these are used alike.

Shapes: J joints.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

State = tuple[NDArray[Any], ...] | None


class Policy(ABC):
    """A policy for `env`, whose hand (`env.unwrapped.hand`) and control rate it may read, never its truth."""

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        self.joints: int = env.action_space.shape[0]  # type: ignore[index]
        self.rng = np.random.default_rng(seed)

    @abstractmethod
    def predict(
        self,
        observation: Any,
        state: State = None,
        episode_start: NDArray[np.bool_] | bool | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], State]:
        """Action (J,) in [-1, 1], and the state to hand to the next call; None or `episode_start` starts anew."""
