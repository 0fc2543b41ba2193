"""Forward kinematics, its Jacobian and the spread of the links, against MuJoCo, differences and chance."""

from __future__ import annotations

import copy
import dataclasses

import mujoco
import numpy as np
import pytest

from haptic_env import hands
from haptic_env.composer import mjcf
from observer import jacobians, kinematics
from tests.observer.hands import random_tree

EVERY_HAND = [*hands.HANDS, "tree0", "tree1", "tree2"]


@pytest.fixture(params=EVERY_HAND)
def hand(request: pytest.FixtureRequest):
    """Every registered hand, and random trees."""
    name = request.param
    return random_tree(int(name[4:])) if name.startswith("tree") else hands.make(name)


def _poses(hand, count: int) -> np.ndarray:
    low, high = hand.joint_limits.T
    return np.random.default_rng(0).uniform(low - 0.2, high + 0.2, (count, hand.joints))


def _mujoco(hand, q) -> mujoco.MjData:
    data = mujoco.MjData(hand.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(hand.model, data)
    mujoco.mj_comPos(hand.model, data)
    return data


def _frames(tree, q) -> tuple[np.ndarray, np.ndarray]:
    position, rotation = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
    kinematics.body_frames(tree, q, position, rotation)
    return position, rotation


def test_the_random_trees_have_what_a_hand_may_have():
    model = random_tree(0).model
    assert model.body_jntnum.max() >= 2
    assert np.abs(model.jnt_pos).min() > 0
    assert np.abs(model.qpos0).max() > 0
    assert np.bincount(model.body_parentid[1:]).max() >= 2, "it branches"


def test_forward_kinematics_are_mujocos(hand):
    tree = kinematics.tree_of(hand)
    for q in _poses(hand, 50):
        data = _mujoco(hand, q)
        position, rotation = _frames(tree, q)
        np.testing.assert_allclose(position, data.xpos, atol=1e-6)
        np.testing.assert_allclose(rotation, data.xmat.reshape(-1, 3, 3), atol=1e-6)
        at, turn = kinematics.link_frames(tree, q)
        np.testing.assert_allclose(at, data.xpos[hand.link_bodies], atol=1e-6)
        np.testing.assert_allclose(turn, data.xmat.reshape(-1, 3, 3)[hand.link_bodies], atol=1e-6)


def test_point_jacobian_is_mujocos_and_that_of_differences(hand):
    tree, rng, step = kinematics.tree_of(hand), np.random.default_rng(1), 1e-6
    for q in _poses(hand, 10):
        data = _mujoco(hand, q)
        position, rotation = _frames(tree, q)
        for body in range(1, hand.model.nbody):
            local = rng.uniform(-0.02, 0.02, 3)
            point = position[body] + rotation[body] @ local
            jacobian = np.full((3, hand.joints), np.nan)
            jacobians.point_jacobian(tree, q, position, rotation, body, point, jacobian)
            expected = np.empty((3, hand.joints))
            mujoco.mj_jac(hand.model, data, expected, None, point, body)
            np.testing.assert_allclose(jacobian, expected, atol=1e-9)
            for joint in range(hand.joints):
                moved = []
                for sign in (-1, 1):
                    there = _frames(tree, q + sign * step * np.eye(hand.joints)[joint])
                    moved.append(there[0][body] + there[1][body] @ local)
                np.testing.assert_allclose(jacobian[:, joint], (moved[1] - moved[0]) / (2 * step), atol=1e-7)


def _lengths(hand):
    return np.array([link.length for link in hand.links])


def test_link_spread_is_the_rms_of_sampled_places(hand):
    tree, rng = kinematics.tree_of(hand), np.random.default_rng(2)
    q = _poses(hand, 1)[0]
    half = 0.01 * rng.standard_normal((hand.joints, hand.joints)) / np.sqrt(hand.joints)
    spread = jacobians.link_spread(tree, _lengths(hand), q, half @ half.T)
    middles = []
    for _ in range(4000):
        at, turn = kinematics.link_frames(tree, q + half @ rng.standard_normal(hand.joints))
        middles.append(at + 0.5 * _lengths(hand)[:, None] * turn[:, :, 2])
    sampled = np.sqrt(np.var(middles, axis=0).mean(axis=1))
    np.testing.assert_allclose(spread, sampled, rtol=0.08)


def test_link_spread_of_a_known_pose_is_zero(hand):
    tree = kinematics.tree_of(hand)
    spread = jacobians.link_spread(tree, _lengths(hand), hand.rest_pose, np.zeros((hand.joints, hand.joints)))
    np.testing.assert_array_equal(spread, 0.0)


def test_a_joint_that_is_no_hinge_is_named():
    hand = hands.make("two_finger")
    root = mjcf.from_xml_string(hand.xml, escape_separators=True)
    root.find("joint", "thumb_pip_flexion").type = "slide"
    sliding = dataclasses.replace(copy.copy(hand), xml=root.to_xml_string())
    with pytest.raises(ValueError, match="joint 'thumb_pip_flexion' of hand 'two_finger' is not a hinge"):
        kinematics.tree_of(sliding)
