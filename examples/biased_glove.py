"""A glove whose joint sensors are off by some degrees: the observer finds out by how much, while it explores."""

import gymnasium as gym
import numpy as np

import agents
import haptic_env  # noqa: F401 - registers the environments
from observer import HapticSLAM, ObserverWrapper


def main(steps=250, bias_deg=5.0):
    """True offsets, those found, and the SDs that are told of these, degrees."""
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", sigma_deg=1.0, bias_deg=bias_deg, reveal_truth=True)
    hand = env.unwrapped.hand
    env = ObserverWrapper(env, HapticSLAM.for_env(env, particles=1))  # believes what the environment does
    policy, state = agents.make("random_torque", env, seed=0), None
    observation, info = env.reset(seed=0)
    for _ in range(steps):
        torque, state = policy.predict(observation, state)
        observation, _, _, _, info = env.step(torque)
    true = np.degrees(info["truth"]["joint_offset"])  # for comparison; no observer reads it
    found, std = np.degrees(info["belief"].joint_offset), np.degrees(info["belief"].joint_offset_std)
    for name, *row in zip(hand.joint_names, true, found, std, strict=True):
        print("{:22} off by {:5.1f}°, found {:5.1f} ± {:.1f}°".format(name, *row))
    return true, found, std


if __name__ == "__main__":
    main()
