"""Patches as a list of taxels: what is near one and faces as it does is its skin, and nothing else is felt."""

from __future__ import annotations

import tomllib
from typing import Any

import mujoco
import numpy as np
import pytest

import agents
from haptic_env import hands, registration
from haptic_env.hand import Hand
from haptic_env.neighbours import neighbours
from observer import HapticSLAM
from observer.maps.capsules import body_of, ringing
from observer.shape.skin import skin_of
from tests.haptic_env.own_hands import GRIPPER, gripper, taxels
from tests.haptic_env.test_own_hand import LATTICE


@pytest.fixture
def hand() -> Hand:
    """The gripper with three taxels on each fingertip."""
    return hands.make(GRIPPER / "taxels.toml")


def test_the_example_is_the_gripper_with_taxels_in_place_of_its_patches(hand, tmp_path):
    mine = tomllib.loads((GRIPPER / "taxels.toml").read_text())
    plain = tomllib.loads((GRIPPER / "gripper.toml").read_text())
    del plain["patches"]
    assert {key: value for key, value in mine.items() if key != "taxel"} == plain
    same = hands.make(gripper(tmp_path, (LATTICE, ""), more=taxels()))
    np.testing.assert_array_equal(hand.patches.position, same.patches.position)


def test_patches_are_the_taxels_in_the_order_of_links(hand):
    assert hand.patches.names == tuple(f"{finger}{row}" for finger in ("left", "right", "thumb") for row in range(3))
    assert [hand.links[link].name for link in hand.patches.link] == [
        f"{finger}_distal" for finger in ("left", "right", "thumb") for _ in range(3)
    ]
    assert (np.diff(hand.patches.link) >= 0).all()
    np.testing.assert_array_equal(hand.patches.locate(hand.patches.link, hand.patches.position), np.arange(9))


def test_only_what_is_near_a_taxel_is_felt(hand):
    """Points of the skin of one fingertip against the rule, but for those as near to the edge as cells are large."""
    link = int(hand.patches.link[0])
    radius, length = hand.links[link].radius, hand.links[link].length
    rng = np.random.default_rng(0)
    turn, height = rng.uniform(-np.pi, np.pi, 4000), rng.uniform(0.0, length, 4000)
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    patch = hand.patches.locate(np.full(len(points), link), points)
    mine = np.flatnonzero(hand.patches.link == link)
    gap = np.linalg.norm(points[:, None] - hand.patches.position[mine], axis=2)
    near = gap.min(axis=1)
    assert (patch[near < 0.003] == mine[gap.argmin(axis=1)][near < 0.003])[
        np.ptp(gap, axis=1)[near < 0.003] > 0.004
    ].all()
    assert (patch[near > 0.0055] == -1).all()
    bare = next(i for i, each in enumerate(hand.links) if each.name == "left_proximal")
    assert (hand.patches.locate(np.full(10, bare), points[:10]) == -1).all()


@pytest.mark.parametrize("spacing", [0.0005, 0.002, 0.02])
def test_points_of_the_skin_leave_no_taxel_out(hand, spacing):
    skin = hand.patches.surface(spacing)
    assert set(skin.patch.tolist()) == set(range(9))
    np.testing.assert_array_equal(hand.patches.link[skin.patch], skin.link)
    assert (np.diff(skin.link) >= 0).all()


def test_neighbours_are_taxels_that_meet(hand):
    beside = neighbours(hand.patches)
    assert beside.shape == (9, 9)
    assert beside[0, 1]
    assert beside[1, 2]
    assert not beside[0, 2]
    assert not beside[2, 3]


def test_compiled_code_knows_which_rows_a_taxel_has(hand):
    body = body_of(hand.patches, 0.004)
    contacts = np.zeros(9, dtype=bool)
    contacts[0] = True
    rows = ringing(body, contacts)
    link = int(hand.patches.link[0])
    assert not np.delete(rows, link, axis=0).any()
    cells = np.flatnonzero(hand.patches.layout.patch == 0) - hand.patches.layout.cell[link]
    assert set(np.flatnonzero(rows[link])) == set(np.minimum(cells // hand.patches.around, hand.patches.along))


def test_links_that_feel_nothing_have_no_points(hand):
    skin = skin_of(hand)
    felt = np.isin(np.arange(len(hand.links)), hand.patches.link)
    np.testing.assert_array_equal(np.diff(skin.first_bead) > 0, felt)
    assert (skin.ball[~felt] == 0).all()


def test_a_taxel_feels_as_far_as_its_radius(tmp_path):
    small = hands.make(gripper(tmp_path, (LATTICE, ""), more=taxels(1).replace("0.004\n", "0.002\n")))
    large = hands.make(gripper(tmp_path, (LATTICE, ""), more=taxels(1).replace("0.004\n", "0.006\n")))
    np.testing.assert_allclose(small.patches.area, np.pi * 0.002**2, rtol=0.5)
    assert (large.patches.area > 5 * small.patches.area).all()


def test_an_object_is_felt_where_there_is_a_taxel_and_nowhere_else(tmp_path):
    """Fingers that go about a cube touch it with skin that feels nothing as well."""
    path = gripper(tmp_path, (LATTICE, ""), more=taxels())
    env = registration.make(str(path), shape="cube", reveal_truth=True)
    world: Any = env.unwrapped
    hand, tree = world.hand, mujoco.MjData(world.hand.model)
    policy, state = agents.make("random_torque", env, seed=0), None
    observation, info = env.reset(seed=900000)
    unfelt = felt = 0
    for _ in range(300):
        torque, state = policy.predict(observation, state)
        observation, _, _, _, info = env.step(torque)
        tree.qpos[:] = info["truth"]["joint_angles"]
        mujoco.mj_kinematics(hand.model, tree)
        touched = np.flatnonzero(observation["contacts"])
        bodies = hand.link_bodies[hand.patches.link[touched]]
        turn = tree.xmat[bodies].reshape(-1, 3, 3)
        place = tree.xpos[bodies] + np.einsum("pij,pj->pi", turn, hand.patches.position[touched])
        assert (np.abs(world.solid.signed_distance(place)) < 0.006).all()
        felt += len(touched)
        unfelt += bool(world._data.ncon) and not len(touched)
    assert felt > 0
    assert unfelt > 0


def test_maps_hold_a_touch_for_what_is_before_its_taxel(hand):
    """And not for what is about skin that feels nothing, of the same rows."""
    observer = HapticSLAM(hand, 1.0, particles=5)
    observer.reset(seed=0)
    contacts = np.arange(9) == 8
    for _ in range(30):
        observer.step(np.zeros(hand.joints), hand.rest_pose, contacts)
    occupancy = observer.map_now()
    data = mujoco.MjData(hand.model)
    data.qpos[:] = hand.rest_pose
    mujoco.mj_kinematics(hand.model, data)
    body = hand.link_bodies[hand.patches.link[8]]
    place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ hand.patches.position[8]
    likely = observer.grid.centres().reshape(-1, 3)[(occupancy > 0.5).ravel()]
    assert len(likely)
    assert np.linalg.norm(likely - place, axis=1).max() < 0.012
