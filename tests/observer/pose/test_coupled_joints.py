"""What observers make of joints that follow others: readings are of one thing, and the pose never tears them apart."""

from __future__ import annotations

import dataclasses

import gymnasium as gym
import numpy as np
import pytest

import agents
import haptic_env  # noqa: F401  registers
from haptic_env import hand_of
from haptic_env.coupling import Couplings
from observer import HapticSLAM
from observer.pose.coupled_joints import fuse
from observer.pose.forward_model import ForwardModel
from observer.pose.kalman import PoseFilter
from tests.haptic_env.test_couplings import coupled

MOTIONS = ("forward_model", "kinematic")


def uncoupled(hand):
    """The same hand, whose observers do not know that joints follow others."""
    blind = dataclasses.replace(hand)
    blind.__dict__["couplings"] = Couplings(hand.joints)
    return blind


@pytest.fixture(scope="module")
def env(tmp_path_factory):
    path = coupled(tmp_path_factory.mktemp("coupled"))
    return gym.make("HapticSLAM/Explore-v0", hand=str(path), shape="cube", sigma_deg=3.0, reveal_truth=True)


def told(observer, motion, torque, angles, contacts):
    return observer.step(torque if motion == "forward_model" else None, angles, contacts)


def errors(env, make, motion, seeds, keep=lambda hand, angles: angles, steps=120):
    """Online errors (T, J) and how often the 90 % interval holds the truth, of an observer about exploration."""
    off, inside, hand = [], [], hand_of(env)
    for seed in seeds:
        observation, _ = env.reset(seed=seed)
        observer, policy, state = make(), agents.make("random_torque", env, seed=seed), None
        observer.reset(0, observation["joint_angles"] if motion == "kinematic" else None)
        for _ in range(steps):
            torque, state = policy.predict(observation, state)
            observation, _, _, _, info = env.step(torque)
            angles = keep(hand, observation["joint_angles"].astype(float))
            belief = told(observer, motion, torque, angles, observation["contacts"])
            off.append(belief.joint_angles - info["truth"]["joint_angles"])
            inside.append(np.abs(off[-1]) < 1.645 * belief.joint_std)
            if observer.hand is hand:
                np.testing.assert_allclose(hand.couplings.follow(belief.joint_angles), belief.joint_angles, atol=0.02)
    return np.array(off), np.mean(inside)


def test_one_that_knows_of_followers_is_more_exact_without_torques(env):
    """Two readings of one thing are better than one: σ/√(1 + 0.8²) of a root with a follower of slope 0.8."""
    hand, seeds = hand_of(env), range(900000, 900003)
    knows, share = errors(env, lambda: HapticSLAM(hand, 3.0, particles=1, motion="kinematic"), "kinematic", seeds)
    root = int(hand.couplings.root[hand.couplings.follows][0])
    pair = np.flatnonzero(hand.couplings.root == root)
    blind, _ = errors(
        env, lambda: HapticSLAM(uncoupled(hand), 3.0, particles=1, motion="kinematic"), "kinematic", seeds
    )
    assert np.square(knows[:, pair]).mean() < 0.85 * np.square(blind[:, pair]).mean()
    assert share > 0.85


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_follower_that_is_not_measured_is_known_by_its_leader(env, motion):
    hand = hand_of(env)
    follows = hand.couplings.follows
    make = lambda: HapticSLAM(hand, 3.0, particles=1, motion=motion)  # noqa: E731
    off, share = errors(env, make, motion, [900003], lambda _, angles: np.where(follows, np.nan, angles))
    assert np.sqrt(np.square(off[:, follows]).mean()) < np.deg2rad(3.0)
    assert share > 0.8


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_reading_that_was_made_of_the_leaders_is_no_second_one(env, motion):
    """A column that a file lacks is filled by the coupling; nobody becomes surer by it."""
    hand = hand_of(env)
    follows = hand.couplings.follows
    first, second = (HapticSLAM(hand, 3.0, particles=1, motion=motion) for _ in range(2))
    rng = np.random.default_rng(0)
    start = hand.rest_pose
    for each in (first, second):
        each.reset(0, start)
    for _ in range(10):
        felt = hand.couplings.follow(start + 0.05 * rng.standard_normal(hand.joints))
        nothing, still = np.zeros(len(hand.patches)), np.zeros(hand.joints)
        one = told(first, motion, still, felt, nothing)
        other = told(second, motion, still, np.where(follows, np.nan, felt), nothing)
        np.testing.assert_array_equal(one.joint_std, other.joint_std)
        np.testing.assert_array_equal(one.joint_angles, other.joint_angles)


def test_readings_are_weighted_by_what_they_tell_of_the_root(env):
    hand = hand_of(env)
    couplings, rng = hand.couplings, np.random.default_rng(1)
    truth = couplings.follow(hand.rest_pose + 0.1)
    heard = np.ones(hand.joints, dtype=bool)
    off = []
    for _ in range(4000):
        felt = truth + 0.05 * rng.standard_normal(hand.joints)
        fused = fuse(couplings, felt, heard, hand.rest_pose, 0.05)
        off.append(fused.angles - truth)
    expected = np.sqrt(np.square(fused.spread).sum(axis=1))
    np.testing.assert_allclose(np.std(off, axis=0), expected, rtol=0.05)
    assert (expected[couplings.root != np.arange(hand.joints)] < 0.05).all()


def test_the_forward_model_moves_what_follows(env):
    """Its Jacobians are those of a hand that has as many joints as lead, by differences of whole steps."""
    hand = hand_of(env)
    model, couplings, joints = ForwardModel(hand, 50.0), hand.couplings, hand.joints
    state = np.concatenate([hand.rest_pose, np.zeros(joints)])
    torque = np.where(couplings.follows, 0.0, 0.4)
    for _ in range(4):
        state = model.predict(state, torque).state
    np.testing.assert_allclose(couplings.follow(state[:joints]), state[:joints], atol=1e-12)
    found = model.predict(state, torque)
    along = couplings.along(state[:joints])
    for root in np.flatnonzero(~couplings.follows):
        for way in (along[:, root], along[:, joints + root]):
            ahead, behind = (model.predict(state + sign * 1e-4 * way, torque).state for sign in (1.0, -1.0))
            differences = (ahead - behind) / 2e-4
            np.testing.assert_allclose(
                found.transition @ way, differences, atol=0.15 * np.abs(differences).max() + 0.01
            )


def test_what_a_step_adds_tears_no_joints_apart(env):
    hand = hand_of(env)
    pose, joints = PoseFilter(hand, sigma=0.05, motor_noise=0.1, control_hz=50.0, lag=2), hand.joints
    for _ in range(5):
        pose.step(np.zeros(joints), hand.rest_pose, np.zeros(len(hand.patches), dtype=bool))
    follower = int(np.flatnonzero(hand.couplings.follows)[0])
    apart = np.zeros(len(pose.mean))
    apart[joints + follower] = 1.0
    apart[joints + hand.couplings.root[follower]] = -hand.couplings.slopes(pose.angles)[follower]
    assert apart @ pose.covariance @ apart < 1e-3 * np.min(pose.velocity_noise) ** 2
