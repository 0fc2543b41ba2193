"""The exploration on which the benchmark measures, and the observer that is measured.

Shapes: T steps, J joints, P patches.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import agents
from haptic_env import registration
from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from observer import HapticSLAM


@dataclass(frozen=True)
class BenchRecording:
    """An exploration.

    Attributes:
        env: in which it was made.
        hand: that explored.
        seed: of the exploration.
        sigma_deg: noise of the felt angles, degrees.
        torques: (T, J) commanded, fractions.
        controls: (T, J) with motor noise, fractions.
        felt: (T, J) rad.
        contacts: (T, P).
    """

    env: gym.Env[Any, Any]
    hand: Hand
    seed: int
    sigma_deg: float
    torques: NDArray[np.float32]
    controls: Array
    felt: NDArray[np.float32]
    contacts: NDArray[np.bool_]

    @property
    def touching(self) -> NDArray[np.bool_]:
        """(T,) whether any patch felt contact."""
        return np.asarray(self.contacts.any(axis=1))

    def lagged(self, lag: int) -> NDArray[np.bool_]:
        """Tell at which steps a touch enters the maps.

        Args:
            lag: steps of the observer.

        Returns:
            (T,) whether any patch felt contact at the step that enters the maps `lag` steps later.
        """
        return np.concatenate([np.zeros(lag, dtype=bool), self.touching[: len(self.touching) - lag]])


def record(env_id: str, shape: str, sigma_deg: float, seed: int, steps: int, **keywords: Any) -> BenchRecording:
    """Explore with random torques.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        shape: that is explored.
        sigma_deg: noise of the felt angles, degrees.
        seed: of the exploration.
        steps: T.
        **keywords: of the environment.

    Returns:
        What was commanded and felt.
    """
    env = registration.make(env_id, shape=shape, sigma_deg=sigma_deg, episode_seconds=3600.0, **keywords)
    base: Any = env.unwrapped
    observation, _ = env.reset(seed=seed)
    policy, state = agents.make("random_torque", env, seed=seed), None
    rows = []
    for _ in range(steps):
        torque, state = policy.predict(observation, state)
        observation, *_ = env.step(torque)
        felt, contacts = observation["joint_angles"], observation["contacts"].astype(bool)
        rows.append((torque, base._data.ctrl.copy(), felt, contacts))
    return BenchRecording(env, base.hand, seed, sigma_deg, *(np.array(each) for each in zip(*rows, strict=True)))


def make_slam(recording: BenchRecording, particles: int, voxels: int) -> HapticSLAM:
    """Make the observer that is timed.

    Args:
        recording: of whose hand.
        particles: N.
        voxels: along the longest edge of the hand's workspace.

    Returns:
        The observer.
    """
    hand = recording.hand
    grid = Grid.around(hand.grasp_centre, hand.workspace, float(hand.workspace.max()) / voxels)
    return HapticSLAM(hand, recording.sigma_deg, particles, grid=grid)
