"""Random torques, smooth in time: the paper's exploration."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.ornstein_uhlenbeck import OrnsteinUhlenbeck
from agents.policy import Policy, State
from haptic_env import hand_of

WRIST = 0.35  # of the torques of a wrist that moves, which would carry the hand away from what it explores


class RandomTorque(Policy):
    """An Ornstein–Uhlenbeck process per joint, squashed to [-1, 1] by tanh; less for a wrist that moves.

    `deterministic` takes the process's mean step, so that torques decay to zero.
    """

    blind = True

    def __init__(
        self, env: gym.Env[Any, Any], seed: int | None = None, *, sd: float = 1.0, seconds: float = 0.3
    ) -> None:
        """Start the process.

        Args:
            env: one environment, with a hand.
            seed: of the process.
            sd: stationary SD before squashing.
            seconds: s, time constant.

        Raises:
            ValueError: for a value out of range.
        """
        super().__init__(env, seed)
        self.drive = OrnsteinUhlenbeck(env, self.joints, sd=sd, seconds=seconds)
        self.remembers = ((self.drive.size,),)
        self._scale = np.ones(self.joints, np.float32)
        self._scale[hand_of(env).wrist] = WRIST

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        drive = self.drive.next(self.rng, state, deterministic)
        return np.tanh(drive).astype(np.float32) * self._scale, (drive,)
