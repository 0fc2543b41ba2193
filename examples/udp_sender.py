"""Stands in for a hand's driver: a simulated gripper feels a sphere, and what it feels goes out by UDP.

In another terminal, before: haptic-slam live --udp 5005 --hand examples/gripper/gripper.toml --candidates cube sphere
"""

import json
import socket
import time
from pathlib import Path

import gymnasium as gym

import agents
import haptic_env  # noqa: F401 - registers the environments

GRIPPER = Path(__file__).parent / "gripper" / "gripper.toml"


def main(port=5005, seconds=10.0, pace=0.02):
    """Send a line of JSON for each step."""
    env = gym.make("HapticSLAM/Explore-v0", hand=str(GRIPPER), shape="sphere", sigma_deg=2.0, episode_seconds=seconds)
    names = env.unwrapped.hand.joint_names
    policy, state = agents.make("random_torque", env, seed=0), None
    observation, _ = env.reset(seed=0)
    to = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    over, step = False, 0
    while not over:
        joints = dict(zip(names, observation["joint_angles"].tolist(), strict=True))  # radians
        line = {"time": step / 50, "joints": joints, "contacts": observation["contacts"].tolist()}
        to.sendto(json.dumps(line).encode(), ("127.0.0.1", port))
        torque, state = policy.predict(observation, state)
        observation, _, _, over, _ = env.step(torque)
        step += 1
        time.sleep(pace)
    to.close()
    return step


if __name__ == "__main__":
    main()
