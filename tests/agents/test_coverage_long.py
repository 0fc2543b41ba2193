"""How much of an object `coverage` reaches in a minute, and the surface that follows, between its brackets."""

from __future__ import annotations

import functools

import gymnasium as gym
import numpy as np
import pytest
from scipy.spatial import cKDTree

import agents
from haptic_env import shapes
from observer import HapticSLAM, ObserverWrapper
from observer.brackets import DeadReckoning, TruePose
from observer.surface.metrics import mesh_score
from observer.surface_metrics import surface_coverage, surface_places, touched_places

pytestmark = pytest.mark.statistical
SIGMA, SECONDS, FIRST_SEED = 3.0, 60.0, 62000  # what the policy was made with had seeds from 900000 on


@functools.cache
def covered(shape: str) -> dict[str, tuple[float, float]]:
    """By bracket the share of the surface's voxels and the intersection over union of the mesh; of "touched" the share
    that the skin was at."""
    env = gym.make(
        "HapticSLAM/TwoFingerArm-v0", shape=shape, sigma_deg=SIGMA, reveal_truth=True, episode_seconds=SECONDS
    )
    world, seed = env.unwrapped, FIRST_SEED + list(shapes.SHAPES).index(shape)
    hand = world.hand
    watched = ObserverWrapper(env, HapticSLAM(hand, SIGMA, particles=1))
    policy, state = agents.make("coverage", watched, seed=seed), None
    observation, _ = watched.reset(seed=seed)
    floor, ceiling = DeadReckoning(hand, SIGMA), TruePose(hand)
    floor.reset(seed=0)
    ceiling.reset(seed=0)
    true, felt = [], []
    for _ in range(world.episode_steps):
        torque, state = agents.act(policy, observation, state)
        observation, *_, info = watched.step(torque)
        true.append(info["truth"]["joint_angles"])
        felt.append(observation["contacts"].astype(bool))
        floor.step(torque, observation["joint_angles"], felt[-1])
        ceiling.step(torque, true[-1], felt[-1])
    touched = touched_places(hand, np.array(true), np.array(felt), world.solid)
    beliefs = {"floor": floor.flush()[-1], "slam": watched.belief, "ceiling": ceiling.flush()[-1]}
    result = {}
    for name, belief in beliefs.items():
        share = surface_coverage(belief.occupancy, belief.grid, world.solid)
        result[name] = share, mesh_score(belief.surface(), world.solid, touched).iou
    grid = watched.belief.grid
    near = cKDTree(touched).query(surface_places(world.solid, grid))[0] <= grid.resolution
    result["touched"] = float(near.mean()), float("nan")
    env.close()
    print(shape, {name: tuple(np.round(each, 3)) for name, each in result.items()})
    return result


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_a_minute_maps_the_object_from_all_sides(shape):
    scores = covered(shape)
    assert scores["touched"][0] > 0.8
    assert scores["floor"][0] + 0.2 < scores["slam"][0] <= scores["ceiling"][0] + 0.02
    assert scores["floor"][1] < scores["slam"][1] < scores["ceiling"][1]


def test_on_average_the_mesh_shares_four_fifths_with_the_object():
    assert np.mean([covered(shape)["slam"][1] for shape in shapes.SHAPES]) > 0.82
