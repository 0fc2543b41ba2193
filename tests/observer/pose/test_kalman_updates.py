"""The compiled parts of the pose filter against textbook formulas in plain NumPy."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from haptic_env import hands
from observer.kinematics import tree_of
from observer.pose import kalman_updates
from observer.pose.contact_forces import PatchForces, contact_effects
from observer.pose.forward_model import LARGEST_GROWTH, _repeated
from observer.pose.kalman_updates import Measurement
from tests.observer.hands import random_tree

LAGS = [0, 1, 4]
HANDS = {**hands.HANDS, "tree": lambda: random_tree(0)}


def _belief(rng, joints, lag):
    """A mean (S,) and a covariance (S, S) of numbers as different as angles and velocities are."""
    size = (2 + lag) * joints
    scale = np.where(np.arange(size) // joints == 1, 5.0, 0.1)
    root = scale[:, None] * rng.standard_normal((size, size))
    return rng.standard_normal(size), root @ root.T / size


def shifted(mean, covariance, state, transition, noise, joints):
    """One linear map of everything that the filter holds, and its noise."""
    size = len(mean)
    whole = np.zeros((size, size))
    whole[: 2 * joints, : 2 * joints] = transition
    if size > 2 * joints:
        whole[2 * joints : 3 * joints, :joints] = np.eye(joints)
        whole[3 * joints :, 2 * joints : -joints] = np.eye(size - 3 * joints)
    mean, covariance = whole @ mean, whole @ covariance @ whole.T
    mean[: 2 * joints] = state
    covariance[: 2 * joints, : 2 * joints] += noise
    return mean, covariance


def conditioned(mean, covariance, row, value, variance):
    """One measurement (Joseph's form): mean, covariance and the log density of `value`."""
    row = np.pad(row, (0, len(mean) - len(row)))
    total = row @ covariance @ row + variance
    gain, residual = covariance @ row / total, value - row @ mean
    left = np.eye(len(mean)) - np.outer(gain, row)
    covariance = left @ covariance @ left.T + variance * np.outer(gain, gain)
    return mean + gain * residual, covariance, -0.5 * (residual**2 / total + np.log(2 * np.pi * total))


def test_process_noise_is_that_of_motors_and_velocities():
    rng = np.random.default_rng(4)
    gain, torque, limits = rng.standard_normal((6, 3)), rng.uniform(-1, 1, 3), rng.uniform(0.01, 1, 3)
    expected = gain @ np.diag((0.1 * torque * limits) ** 2) @ gain.T + np.diag([0, 0, 0, 0.36, 0.25, 0.01])
    got = kalman_updates.process_noise(gain, torque, limits, 0.1, np.array([0.6, 0.5, 0.1]))
    np.testing.assert_allclose(got, expected, atol=1e-14)


@pytest.mark.parametrize("lag", LAGS)
@pytest.mark.parametrize("joints", [1, 3, 8])
def test_moving_on_is_one_linear_map(joints, lag):
    rng = np.random.default_rng(0)
    mean, covariance = _belief(rng, joints, lag)
    transition, state = rng.standard_normal((2 * joints, 2 * joints)), rng.standard_normal(2 * joints)
    noise = np.cov(rng.standard_normal((2 * joints, 50)))
    expected = shifted(mean, covariance, state, transition, noise.reshape(2 * joints, -1), joints)
    kalman_updates.shift(mean, covariance, state, transition, noise, joints, np.zeros(0), np.zeros(0))
    np.testing.assert_allclose(mean, expected[0], atol=1e-12)
    np.testing.assert_allclose(covariance, expected[1], atol=1e-9)


@pytest.mark.parametrize("lag", LAGS)
@pytest.mark.parametrize("joints", [1, 3, 8])
@pytest.mark.parametrize("count", [0, 1, 7])
def test_conditioning_is_one_measurement_after_another(joints, lag, count):
    rng = np.random.default_rng(1)
    mean, covariance = _belief(rng, joints, lag)
    rows, value = rng.standard_normal((count, 2 * joints)), rng.standard_normal(count)
    rows[:, :joints] *= rng.random() < 0.5
    variance, felt, felt_variance = rng.uniform(1e-4, 1.0, count), rng.standard_normal(joints), 1e-3
    expected, log_density = (mean, covariance), 0.0
    for each in zip(rows, value, variance, strict=True):
        expected = conditioned(*expected, *each)[:2]
    for joint in range(joints):
        *expected, more = conditioned(*expected, np.eye(joints)[joint], felt[joint], felt_variance)
        log_density += more
    mean, covariance = mean.copy(), covariance.copy()
    got = kalman_updates.condition(
        mean, covariance, Measurement(rows, value, variance), felt, np.full(joints, felt_variance), 2 * joints, 0
    )
    assert got == pytest.approx(log_density, rel=1e-9)
    np.testing.assert_allclose(mean, expected[0], atol=1e-9)
    np.testing.assert_allclose(covariance, expected[1], atol=1e-9)
    np.testing.assert_array_equal(covariance, covariance.T)


@pytest.mark.parametrize("name", HANDS)
def test_contact_effects_are_those_of_mujocos_jacobian(name):
    hand, rng = HANDS[name](), np.random.default_rng(2)
    joints, patches = hand.joints, hand.patches
    q, gain = rng.uniform(-0.5, 0.5, joints), rng.standard_normal((2 * joints, joints))
    body = hand.link_bodies[patches.link]
    axes = np.linalg.qr(rng.standard_normal((len(patches), 3, 3)))[0]
    force = rng.uniform(0.0, 1.0, (len(patches), 3))
    felt = rng.choice(len(patches), 5, replace=False)
    noise, along = np.eye(2 * joints), np.empty((5, 3, joints))
    contact_effects(tree_of(hand), q, gain, PatchForces(body, patches.position, axes, force), 0.0, felt, noise, along)
    data = mujoco.MjData(hand.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(hand.model, data)
    mujoco.mj_comPos(hand.model, data)
    expected = np.eye(2 * joints)
    for patch, speeds in zip(felt, along, strict=True):
        frame, jacobian = data.xmat[body[patch]].reshape(3, 3), np.empty((3, joints))
        point = data.xpos[body[patch]] + frame @ patches.position[patch]
        mujoco.mj_jac(hand.model, data, jacobian, None, point, body[patch])
        np.testing.assert_allclose(speeds, axes[patch] @ frame.T @ jacobian, atol=1e-12)
        push = gain @ speeds.T * force[patch]
        expected += push @ push.T
    np.testing.assert_allclose(noise, expected, atol=1e-12)


@pytest.mark.parametrize("times", [1, 2, 7, 10])
def test_many_steps_at_once_are_the_steps_one_by_one(times):
    rng = np.random.default_rng(3)
    a, b = np.eye(4) + 0.1 * rng.standard_normal((4, 4)), rng.standard_normal((4, 2))
    transition, gain = np.eye(4), np.zeros((4, 2))
    for _ in range(times):
        transition, gain = a @ transition, a @ gain + b
    *got, grows = _repeated(a, b, times, np.ones(b.shape[1]))
    assert grows == (not np.abs(got[0][: b.shape[1], : b.shape[1]]).max() <= LARGEST_GROWTH)
    np.testing.assert_allclose(got[0], transition, rtol=1e-12)
    np.testing.assert_allclose(got[1], gain, rtol=1e-12)
