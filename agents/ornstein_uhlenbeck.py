"""Numbers drawn at random, smooth in time: what `random_torque` and `synergy` drive a hand with."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from agents.policy import State
from haptic_env import hand_env, validate
from haptic_env.arrays import Array
from haptic_env.moved import renamed

LARGEST = 1e6  # SD of the numbers, which are fractions of a torque

__getattr__ = renamed(__name__, {"SmoothChance": "OrnsteinUhlenbeck"})


class OrnsteinUhlenbeck:
    """An Ornstein–Uhlenbeck process in each of `size` numbers, of stationary SD `sd` and time constant `seconds`, by
    its exact step at the control rate of `env` (Gillespie 1996, Phys. Rev. E 54, 2084-2091)."""

    def __init__(self, env: gym.Env[Any, Any], size: int, *, sd: float, seconds: float) -> None:
        """Raises `ValueError` for a value out of range."""
        self.size = size
        self.sd = validate.number("sd", sd, 0.0, LARGEST, above=0.0)
        tau = validate.seconds("seconds", seconds)
        self.decay = float(np.exp(-1.0 / (tau * hand_env(env).control_hz)))

    def next(self, rng: np.random.Generator, state: State, deterministic: bool) -> Array:
        """The numbers (size,) after those in `state`, or the first ones; `deterministic`: the mean of them."""
        fresh = rng.standard_normal(self.size) * (not deterministic)
        if state is None:
            return self.sd * fresh
        return np.asarray(self.decay * state[0] + self.sd * np.sqrt(1 - self.decay**2) * fresh)
