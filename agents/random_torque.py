"""Random torques, smooth in time: the paper's exploration."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.policy import EpisodeStart, Policy, State, starts
from haptic_env import validate


class RandomTorque(Policy):
    """An Ornstein–Uhlenbeck process per joint, squashed to [-1, 1] by tanh.

    `sd` is its stationary SD before squashing, `seconds` its time constant. `deterministic` takes the process's mean
    step, so that torques decay to zero.
    """

    blind = True

    def __init__(
        self, env: gym.Env[Any, Any], seed: int | None = None, *, sd: float = 1.0, seconds: float = 0.3
    ) -> None:
        super().__init__(env, seed)
        self.sd = validate.number("sd", sd, above=0.0)
        tau = validate.number("seconds", seconds, above=0.0, unit="s")
        self.decay = float(np.exp(-1.0 / (tau * env.unwrapped.control_hz)))  # type: ignore[attr-defined]

    def predict(
        self, observation: Any, state: State = None, episode_start: EpisodeStart = None, deterministic: bool = False
    ) -> tuple[NDArray[np.float32], State]:
        if state is None or starts(episode_start):
            drive = self.sd * self.rng.standard_normal(self.joints) * (not deterministic)
        else:
            fresh = self.rng.standard_normal(self.joints) * (not deterministic)
            drive = self.decay * state[0] + self.sd * np.sqrt(1 - self.decay**2) * fresh
        return np.tanh(drive).astype(np.float32), (drive,)
