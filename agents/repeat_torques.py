"""Torques that are known beforehand, one after the other.

Shapes: T steps, J joints.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.policy import Policy, State
from haptic_env import validate


class RepeatTorques(Policy):
    """Commands the rows of `torques` (T, J), fractions; nothing after them."""

    remembers = ((),)

    def __init__(self, env: gym.Env[Any, Any], torques: ArrayLike) -> None:
        """Check the torques.

        Args:
            env: with a hand.
            torques: (T, J), fractions.

        Raises:
            ValueError: for torques of other joints, or beyond ± 1.
        """
        super().__init__(env)
        given = validate.numbers("torques", torques, bound=1.0)
        if given.size and (given.ndim != 2 or given.shape[1] != self.joints):
            raise ValueError(f"torques must be of shape (T, {self.joints}), got {given.shape}")
        self.torques = given.astype(np.float32).reshape(-1, self.joints)

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        step = 0 if state is None else int(state[0])
        torque = self.torques[step] if step < len(self.torques) else np.zeros(self.joints, dtype=np.float32)
        return torque.copy(), (np.array(step + 1),)
