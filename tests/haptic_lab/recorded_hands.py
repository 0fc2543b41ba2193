"""Recordings of hands for long tests: those of people beside the checkout, and hands that explored in the simulation,
whose path is kept as if a camera had seen it."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import agents
from haptic_env import hand_env, registration, shapes
from haptic_env.recordings import Recording
from haptic_env.recordings.recording import Track
from haptic_lab import recorded, replay
from haptic_lab.exploration.run import begin
from haptic_lab.exploration.settings import DEFAULTS, ExplorationSettings

SHARED = Path(__file__).resolve().parents[3] / "shared"
PEOPLE = {"cube": "cubemedium", "sphere": "spheremedium", "cylinder": "cylinderlarge"}
HAND = "HapticSLAM/MyoHand-v0"
SECONDS = 2.0  # of an exploration in the simulation, as of the recordings of people
SIGMA = 3.0  # degrees
people = pytest.mark.skipif(not SHARED.exists(), reason="the recordings of people are not here")


def mesh_of(name: str) -> str:
    """The path of one of the shared meshes."""
    return str(SHARED / "objects" / f"{PEOPLE.get(name, name)}.stl")


def of_person(label: str) -> Recording:
    """How a person inspected the cube, the sphere or the cylinder."""
    return recorded.load(str(SHARED / "recordings" / f"{PEOPLE[label]}_inspect.npz"), None, None, None)


@cache
def explored(mesh: str, seed: int) -> Recording:
    """How MyoHand swept over a mesh at its grasp centre; of what was felt nothing is kept."""
    env = registration.make(HAND, shape=mesh, sigma_deg=SIGMA, episode_seconds=SECONDS, reveal_truth=True)
    policy, state = agents.make("sweep", env, seed), None
    observation, info = env.reset(seed=seed)
    angles, over = [info["truth"]["joint_angles"]], False
    while not over:
        torque, state = agents.act(policy, observation, state)
        observation, _, _, over, info = env.step(torque)
        angles.append(info["truth"]["joint_angles"])
    base, shape, frames = hand_env(env), shapes.find(mesh), len(angles)
    place = info["truth"]["object_position"] - shape.centre * shape.scale()  # of the file's frame
    still = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    root, held = Track(np.zeros((frames, 3)), still), Track(np.tile(place, (frames, 1)), still)
    time = np.arange(frames) / base.control_hz
    return Recording("explored", time, base.hand.joint_names, np.array(angles), root, "", held)


def session(recording: Recording, mesh: str, among: list[str] | None, seed: int) -> replay.ExplorationSession:
    """The replay of a recording of MyoHand."""
    told = {"env": HAND, "shape": mesh, "sigma": SIGMA, "seed": seed, "candidates": among}
    more = {"seconds": None, "policy": "random_torque", "out": ""}
    return begin(ExplorationSettings(**(DEFAULTS | told | more)), recording)
