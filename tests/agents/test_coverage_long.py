"""How much of an object `coverage` reaches in a minute, and the surface that follows, between its brackets; what a
second look adds; and what a touched place needs to be mapped."""

from __future__ import annotations

import functools
import itertools
from typing import NamedTuple

import gymnasium as gym
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import agents
from haptic_env import hands, shapes
from haptic_env.shapes.sets import SETS
from observer import HapticSLAM, ObserverWrapper, SecondLook
from observer.brackets import DeadReckoning, TruePose
from observer.kinematics import placed_points
from observer.surface.metrics import mesh_score
from observer.surface_metrics import OCCUPIED, TOUCH_TOLERANCE, surface_places, surface_recall, touched_places
from observer.swept_volume import posed

pytestmark = [pytest.mark.statistical, pytest.mark.timeout(3600)]
SIGMA, SECONDS = 3.0, 60.0
FIRST_SEED = 77010  # what the policy was made with had seeds from 900000 on
TOUCHES = (0, 1, 2, 4, 7, 11, 16, 24, 1000)  # near a place, from one class of places to the next


class Reached(NamedTuple):
    """What came of an exploration.

    Attributes:
        touched: share of the surface that the skin was at.
        mapped: by bracket, the share that is mapped.
        iou: by bracket, of the mesh.
        touches: (S,) how often skin was within a voxel of each place of the surface, once a patch and step.
        found: by bracket, (S,) which of them are mapped.
    """

    touched: float
    mapped: dict[str, float]
    iou: dict[str, float]
    touches: NDArray[np.int64]
    found: dict[str, NDArray[np.bool_]]


def _touches(hand, true, felt, solid, places, near: float) -> NDArray[np.int64]:
    """(S,) how often the skin was within `near` m of each of `places` (S, 3) m."""
    skin, found = hand.patches.surface(0.002), []
    for (tree, angles), rang in zip(posed(hand, true, None), felt, strict=True):
        for patch in np.flatnonzero(rang):
            mine = skin.patch == patch
            points = placed_points(tree, angles, skin.points[mine], skin.link[mine])
            gap = np.abs(solid.signed_distance(points))
            if gap.min() <= TOUCH_TOLERANCE:
                found.append(points[gap.argmin()])
    return np.array([len(each) for each in cKDTree(np.array(found)).query_ball_point(places, near)])


def _found(occupancy, grid, places) -> NDArray[np.bool_]:
    """(S,) which of `places` (S, 3) m have an occupied voxel within one."""
    away = cKDTree(grid.centres()[occupancy > OCCUPIED]).query(places)[0]
    return away <= grid.resolution * (1 + 1e-6)


@functools.cache
def reached(shape: str) -> Reached:
    """One exploration."""
    env = gym.make(
        "HapticSLAM/TwoFingerArm-v0", shape=shape, sigma_deg=SIGMA, reveal_truth=True, episode_seconds=SECONDS
    )
    world, seed = env.unwrapped, FIRST_SEED + list(shapes.SHAPES).index(shape)
    hand = world.hand
    watched = ObserverWrapper(env, HapticSLAM(hand, SIGMA, particles=1))
    explorer, state = agents.make("coverage", watched, seed=seed), None
    observation, _ = watched.reset(seed=seed)
    floor, again, ceiling = DeadReckoning(hand, SIGMA), SecondLook(hand, SIGMA, particles=1), TruePose(hand)
    for each in (floor, again, ceiling):
        each.reset(seed=0)
    true, felt = [], []
    for _ in range(world.episode_steps):
        torque, state = agents.act(explorer, observation, state)
        observation, *_, info = watched.step(torque)
        true.append(info["truth"]["joint_angles"])
        felt.append(observation["contacts"].astype(bool))
        for each in (floor, again):
            each.step(torque, observation["joint_angles"], felt[-1])
        ceiling.step(torque, true[-1], felt[-1])
    skin = touched_places(hand, np.array(true), np.array(felt), world.solid)
    grid = watched.belief.grid
    places = surface_places(world.solid, grid)
    ends = [each.flush()[-1] for each in (floor, again, ceiling)]
    beliefs = dict(zip(("floor", "slam", "again", "ceiling"), (ends[0], watched.belief, *ends[1:]), strict=True))
    result = Reached(
        float((cKDTree(skin).query(places)[0] <= grid.resolution).mean()),
        {name: surface_recall(belief.occupancy, grid, places) for name, belief in beliefs.items()},
        {name: mesh_score(belief.surface(), world.solid, skin).iou for name, belief in beliefs.items()},
        _touches(hand, true, felt, world.solid, places, grid.resolution),
        {name: _found(belief.occupancy, grid, places) for name, belief in beliefs.items()},
    )
    env.close()
    print(
        shape,
        f"touched {result.touched:.2f}",
        *(f"{k} {v:.2f} {result.iou[k]:.2f}" for k, v in result.mapped.items()),
    )
    return result


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_a_minute_maps_the_object_from_all_sides(shape):
    scores = reached(shape)
    assert scores.touched > 0.8
    assert scores.mapped["floor"] + 0.2 < scores.mapped["slam"] <= scores.mapped["ceiling"] + 0.02
    assert scores.iou["floor"] < scores.iou["slam"] < scores.iou["ceiling"]


def test_a_second_look_maps_more_of_what_was_touched():
    gain = [reached(shape).mapped["again"] - reached(shape).mapped["slam"] for shape in shapes.SHAPES]
    assert np.mean(gain) > 0.02
    assert all(reached(shape).mapped["again"] <= reached(shape).mapped["ceiling"] + 0.02 for shape in shapes.SHAPES)


def test_on_average_the_mesh_shares_four_fifths_with_the_object():
    assert np.mean([reached(shape).iou["slam"] for shape in shapes.SHAPES]) > 0.82


@pytest.mark.parametrize("name", SETS["twelve"])
def test_a_finger_can_touch_all_of_each_solid(name):
    hand = hands.make("two_finger_arm")
    solid, radius = shapes.make(name, position=hand.grasp_centre), min(link.radius for link in hand.links)
    grid = HapticSLAM(hand, SIGMA, particles=1).grid
    places = surface_places(solid, grid)
    near = np.repeat(places, 30, axis=0)
    near = near + np.random.default_rng(0).uniform(-0.75, 0.75, near.shape) * grid.resolution
    for _ in range(4):  # Newton's way onto the surface
        near = near - solid.signed_distance(near)[:, None] * _outwards(solid, near)
    near = near[np.abs(solid.signed_distance(near)) < 2e-4]
    fits = solid.signed_distance(near + radius * _outwards(solid, near)) > radius - 0.001  # a ball that is as thick
    share = (cKDTree(near[fits]).query(places)[0] <= grid.resolution).mean()
    print(f"{name}: {share:.3f} can be touched")
    assert share > 0.99


def _outwards(solid, places) -> NDArray[np.float64]:
    """(M, 3) the way out of the solid at `places` (M, 3) m."""
    step = 1e-4 * np.eye(3)
    way = np.stack([solid.signed_distance(places + each) - solid.signed_distance(places - each) for each in step], -1)
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)


def test_an_inferred_pose_needs_more_touches_of_a_place_than_the_true_one():
    all_of = [reached(shape) for shape in shapes.SHAPES]
    touches = np.concatenate([each.touches for each in all_of])
    found = {name: np.concatenate([each.found[name] for each in all_of]) for name in ("slam", "again", "ceiling")}
    shares = []
    for low, high in itertools.pairwise(TOUCHES):
        mine = (touches >= low) & (touches < high)
        shares.append([mine.mean(), *(each[mine].mean() for each in found.values())])
        print(
            f"{low} to {high - 1} touches:",
            *(f"{name} {share:.2f}" for name, share in zip(("places", *found), shares[-1], strict=True)),
        )
    _, slam, _, ceiling = np.array(shares).T
    assert (ceiling[2:6] > slam[2:6]).all()
    assert slam[-1] > 0.85
