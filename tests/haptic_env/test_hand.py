"""What is told of every registered hand."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest

from haptic_env import hands


@pytest.fixture(params=list(hands.HANDS))
def hand(request: pytest.FixtureRequest):
    """Every registered hand."""
    return hands.make(request.param)


def test_arrays_have_one_entry_per_joint(hand):
    joints = hand.joints
    assert len(hand.joint_names) == len(set(hand.joint_names)) == joints
    assert hand.joint_limits.shape == (joints, 2)
    assert hand.torque_limits.shape == hand.rest_pose.shape == hand.joint_group.shape == (joints,)
    assert (hand.torque_limits > 0).all()
    assert (hand.joint_limits[:, 0] < hand.joint_limits[:, 1]).all()


def test_rest_pose_may_pass_no_limit(hand):
    assert (hand.rest_pose >= hand.joint_limits[:, 0]).all()
    assert (hand.rest_pose <= hand.joint_limits[:, 1]).all()


def test_one_motor_per_joint_in_the_order_of_the_joints(hand):
    assert hand.model.nu == hand.model.nq == hand.model.nv == hand.joints
    np.testing.assert_array_equal(hand.model.actuator_trnid[:, 0], np.arange(hand.joints))


def test_fingers_are_told_apart(hand):
    assert set(hand.link_group) <= set(hand.joint_group)
    for index, body in enumerate(hand.link_bodies):
        own = hand.joint_group[hand.model.jnt_bodyid == body]
        assert (own == hand.link_group[index]).all()


def test_links_are_capsules_of_the_model(hand):
    for link, body in zip(hand.links, hand.link_bodies, strict=True):
        geom = hand.model.geom(hand.model.body_geomadr[body])
        assert geom.size[0] == pytest.approx(link.radius)
        assert 2 * geom.size[1] == pytest.approx(link.length)
        np.testing.assert_allclose(geom.pos, [0, 0, link.length / 2], atol=1e-12)


def test_two_finger_hand_is_as_large_as_an_adults():
    hand = hands.make("two_finger")
    assert hand.joints == 8
    np.testing.assert_array_equal(hand.joint_group, [0] * 4 + [1] * 4)
    mass = hand.model.body_subtreemass[0]
    assert 0.03 < mass < 0.10  # kg: a thumb with its metacarpal and an index finger


def test_unknown_hand_or_keyword_lists_the_known():
    with pytest.raises(ValueError, match=r"unknown hand 'two_fingers' \(did you mean 'two_finger'\?\); choose from"):
        hands.make("two_fingers")
    with pytest.raises(ValueError, match=r"unknown two_finger hand keyword 'patches'.*patches_along, patches_around"):
        hands.make("two_finger", patches=3)


def test_torques_along_a_path_move_the_hand_along_it():
    hand = hands.make("two_finger")
    time = 0.002 * np.arange(400)[:, None]
    path = hand.rest_pose + np.deg2rad(10) * np.sin(2 * np.pi * time) ** 2 * np.linspace(0.3, 1.0, hand.joints)
    torques = hand.torques_along(path, 500.0)
    model = copy.copy(hand.model)
    model.opt.timestep = 0.002
    data = mujoco.MjData(model)
    data.qpos[:] = path[0]
    for torque, place in zip(torques, path, strict=True):
        np.testing.assert_allclose(data.qpos, place, atol=np.deg2rad(0.5))
        data.ctrl[:] = torque / hand.torque_limits
        mujoco.mj_step(model, data)


@pytest.mark.parametrize("size", [None, np.zeros(2), np.full(3, np.nan), "large", np.full(3, 1e9)])
def test_an_object_of_no_size_has_no_place(size):
    with pytest.raises(ValueError, match="object size must"):
        hands.make("two_finger").place(size)


@pytest.mark.parametrize(
    ("path", "rate", "told"),
    [
        (np.zeros((5, 7)), 50.0, r"path must be two frames or more of shape \(T, 8\)"),
        (np.zeros((1, 8)), 50.0, "path must be two frames or more"),
        (np.full((5, 8), np.nan), 50.0, "path must be an array of finite numbers"),
        (np.full((5, 8), 1e9), 50.0, r"path must lie in \[-100, 100\]"),
        (np.zeros((5, 8)), 0.0, "rate must be a finite number"),
    ],
)
def test_a_path_that_no_hand_goes_needs_no_torques(path, rate, told):
    with pytest.raises(ValueError, match=told):
        hands.make("two_finger").torques_along(path, rate)
