"""An error that angles and maps have in common is no news to either."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import agents
from observer import HapticSLAM

SECONDS = 3.0


@pytest.mark.parametrize(("particles", "bias"), [(1, 3.0), (20, 3.0), (20, [3.0] * 4 + [0.0, 1.0, 3.0, 6.0])])
def test_a_map_does_not_correct_an_offset_that_it_has(particles: int, bias: float | list[float]) -> None:
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", sigma_deg=1.0, bias_deg=bias, episode_seconds=SECONDS)
    hand = env.unwrapped.hand
    slam = HapticSLAM(hand, 1.0, particles, bias_deg=bias, motion="kinematic")
    policy, hidden = agents.make("random_torque", env, seed=1), None
    observation, _ = env.reset(seed=1)
    slam.reset(0, observation["joint_angles"])
    moved, over = [], False
    while not over:
        action, hidden = policy.predict(observation, hidden)
        observation, _, _, over, _ = env.step(action)
        belief = slam.step(action, observation["joint_angles"], observation["contacts"])
        if belief.lagged_contacts is not None and belief.lagged_contacts.any():
            moved.append(belief.lagged_joint_angles - slam.pose.mean[slam.pose.lagged(slam.lag)])
    assert len(moved) > 20
    assert np.rad2deg(np.sqrt(np.square(moved).mean())) < 0.25
