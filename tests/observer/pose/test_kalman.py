"""The pose filter against plain linear algebra, and whether it knows how wrong it is."""

from __future__ import annotations

from fractions import Fraction

import mujoco
import numpy as np
import pytest
from scipy import stats

from haptic_env import hands
from observer import ContactModel
from observer.pose import contact_dynamics
from observer.pose.contact_dynamics import ContactDynamics
from observer.pose.forward_model import ForwardModel
from observer.pose.gating import Gate
from observer.pose.kalman import MODEL_NOISE, PoseFilter
from observer.pose.smooth_motion import SmoothMotion
from tests.observer.hands import many_patches, pointer, random_tree

HANDS = {**hands.HANDS, "tree": lambda: random_tree(0), "two_hinges": lambda: pointer(2)}
SIGMA = np.deg2rad(3.0)
VELOCITY_NOISE = 0.3


@pytest.fixture(scope="module", params=HANDS)
def hand(request: pytest.FixtureRequest):
    """Every registered hand, a random tree and a pointer with two joints."""
    return HANDS[request.param]()


def _filter(hand, *, lag=5, sigma=SIGMA, motor_noise=0.1, velocity_noise=VELOCITY_NOISE, **dynamics) -> PoseFilter:
    return PoseFilter(
        hand,
        sigma=sigma,
        motor_noise=motor_noise,
        control_hz=50.0,
        lag=lag,
        dynamics=ContactDynamics(**dynamics),
        velocity_noise=velocity_noise,
    )


def _inside(hand, q, margin=0.0):
    """Angles (J,) clipped to the joints' limits."""
    low, high = hand.joint_limits.T
    return np.clip(q, low + margin, high - margin)


class Linearised:
    """The model about the path that the filter took: x ← f(x̂) + F (x - x̂) + w, solved for all steps at once."""

    def __init__(self, pose: PoseFilter, torques, felt):
        joints = pose.joints
        self.joints = joints
        size = 2 * joints
        rest = np.concatenate([pose.hand.rest_pose, np.zeros(joints)])
        rows, values, sds = [], [], []

        def add(blocks, value, covariance):
            """One block of equations Σ A_k x_k = value + noise, whitened."""
            half = np.linalg.cholesky(covariance)
            row = np.zeros((len(value), size * (len(felt) + 1)))
            for k, block in blocks:
                row[:, k * size : (k + 1) * size] = block
            rows.append(np.linalg.solve(half, row))
            values.append(np.linalg.solve(half, value))
            sds.append(2 * np.log(np.diag(half)).sum() + len(value) * np.log(2 * np.pi))

        add([(0, np.eye(size))], rest, 1e-10 * np.eye(size))
        for k, (torque, angles) in enumerate(zip(torques, felt, strict=True), start=1):
            before = pose.mean[:size].copy()
            prediction = pose.model.predict(before, torque)
            pose.step(torque, angles, np.zeros(len(pose.hand.patches), dtype=bool))
            effort = prediction.torque_gain * (pose.motor_noise * np.abs(torque) * pose.hand.torque_limits)
            noise = effort @ effort.T + 1e-14 * np.eye(size)
            noise[joints:, joints:] += VELOCITY_NOISE**2 * np.eye(joints)
            offset = prediction.state - prediction.transition @ before
            add([(k, np.eye(size)), (k - 1, -prediction.transition)], offset, noise)
            add([(k, np.eye(size)[:joints])], angles, pose.sigma**2 * np.eye(joints))
        a, b = np.concatenate(rows), np.concatenate(values)
        # Not by AᵀA, whose condition is the square of A's: a wrist weighs far more than a fingertip.
        q, r = np.linalg.qr(a)
        half = np.linalg.inv(r)
        self.mean, self.covariance = half @ (q.T @ b), half @ half.T
        square = np.sum((b - a @ self.mean) ** 2)
        # ∫ exp(-|b - a x|² / 2) dx over all states leaves the density of the felt angles.
        self.log_evidence = -0.5 * (square + sum(sds) + 2 * np.linalg.slogdet(r)[1] - a.shape[1] * np.log(2 * np.pi))

    def angles(self, step: int) -> slice:
        """Where the angles of `step` are, 0 being the rest pose."""
        return slice(2 * step * self.joints, (2 * step + 1) * self.joints)


def test_the_fixed_lag_is_least_squares_over_the_whole_path(hand):
    """Free air: mean, covariance, covariance between steps, and the log evidence."""
    rng, steps, lag = np.random.default_rng(0), 9, 5
    pose = _filter(hand, lag=lag)
    felt = _inside(hand, hand.rest_pose + SIGMA * rng.standard_normal((steps, hand.joints)))
    batch = Linearised(pose, rng.uniform(-0.3, 0.3, (steps, hand.joints)), felt)
    for ago in range(lag + 1):
        there = batch.angles(steps - ago)
        np.testing.assert_allclose(pose.mean[pose.lagged(ago)], batch.mean[there], atol=1e-5)
        for other in range(lag + 1):
            block = pose.covariance[pose.lagged(ago), pose.lagged(other)]
            expected = batch.covariance[there, batch.angles(steps - other)]
            np.testing.assert_allclose(block, expected, atol=1e-4 * SIGMA**2)
    assert pose.log_evidence == pytest.approx(batch.log_evidence, abs=1e-2)


@pytest.mark.parametrize("lag", [0, 1, 4])
def test_lagged_angles_move_on_by_one_step(hand, lag):
    """What one step does to the past is a correction by its angles alone, without which nothing but the place moves."""
    pose, rng = _filter(hand, lag=lag, sigma=1e6), np.random.default_rng(0)
    history = [pose.angles]
    for _ in range(7):
        pose.step(rng.uniform(-1, 1, hand.joints), hand.rest_pose, np.zeros(len(hand.patches), dtype=bool))
        history.insert(0, pose.angles)
        for ago in range(min(lag, len(history) - 1) + 1):
            np.testing.assert_allclose(pose.mean[pose.lagged(ago)], history[ago], atol=1e-6)
    assert pose.mean.shape == ((lag + 2) * hand.joints,)


def test_the_past_is_the_rest_pose_before_the_first_step(hand):
    pose = _filter(hand, lag=3)
    for ago in range(4):
        np.testing.assert_array_equal(pose.mean[pose.lagged(ago)], hand.rest_pose)


@pytest.mark.parametrize("constrained", [True, False])
def test_the_covariance_stays_one_in_two_thousand_steps_with_contacts(two_finger, constrained, monkeypatch):
    monkeypatch.setattr(Gate, "judge", lambda *_: None)  # torques and angles have nothing to do with each other here
    pose, rng = _filter(two_finger, lag=10, constrained=constrained), np.random.default_rng(0)
    torque, q = np.zeros(8), two_finger.rest_pose
    for step in range(2000):
        torque = np.clip(0.9 * torque + 0.4 * rng.standard_normal(8), -1, 1)
        contacts = rng.random(len(two_finger.patches)) < (0.1 if step % 100 < 50 else 0.0)
        q = _inside(two_finger, q + 0.05 * rng.standard_normal(8))
        pose.step(torque, q + SIGMA * rng.standard_normal(8), contacts)
        assert np.isfinite(pose.mean).all()
        np.testing.assert_array_equal(pose.covariance, pose.covariance.T)
        if step % 10 == 0:
            values = np.linalg.eigvalsh(pose.covariance)
            assert values.min() > -1e-9 * values.max()
        assert np.sqrt(np.diag(pose.covariance)[:8]).max() < 1.5 * SIGMA, "rad; more than the angles themselves tell"


def _skin_speed(pose: PoseFilter, patch: int) -> float:
    """SD (m/s) of the velocity of a patch in the direction in which it is largest."""
    hand = pose.hand
    data = mujoco.MjData(hand.model)
    data.qpos[:] = pose.angles
    mujoco.mj_kinematics(hand.model, data)
    mujoco.mj_comPos(hand.model, data)
    body = hand.link_bodies[hand.patches.link[patch]]
    frame = data.xmat[body].reshape(3, 3)
    jacobian = np.empty((3, hand.joints))
    mujoco.mj_jac(hand.model, data, jacobian, None, data.xpos[body] + frame @ hand.patches.position[patch], body)
    velocity = pose.covariance[hand.joints : 2 * hand.joints, hand.joints : 2 * hand.joints]
    return float(np.sqrt(np.linalg.eigvalsh(jacobian @ velocity @ jacobian.T).max()))


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")  # so far from the rest pose at first
def test_a_felt_contact_holds_the_skin_still(two_finger):
    """But for `normal_speed` and `tangential_speed`, in every direction; the other finger is free."""
    dynamics = ContactDynamics()
    q = np.deg2rad([15, 60, 40, 30, 0, 20, 30, 20])
    for patch in (0, 1, 7, 11, 19, 21):
        free, held = (_filter(two_finger, velocity_noise=5.0) for _ in range(2))
        contacts = np.zeros(len(two_finger.patches), dtype=bool)
        rng = np.random.default_rng(0)
        for step in range(60):
            felt = q + SIGMA * rng.standard_normal(8)
            free.step(np.zeros(8), felt, np.zeros_like(contacts))
            contacts[patch] = step >= 50
            held.step(np.zeros(8), felt, contacts.copy())
        assert _skin_speed(held, patch) < 1.1 * max(dynamics.normal_speed, dynamics.tangential_speed)
        assert _skin_speed(held, patch) < 0.7 * _skin_speed(free, patch)
        finger = two_finger.joint_group == two_finger.link_group[two_finger.patches.link[patch]]
        np.testing.assert_allclose(held.mean[:8][~finger], free.mean[:8][~finger], atol=1e-3)


def test_exact_angles_are_believed(hand):
    pose, middle = _filter(hand, sigma=0.0), hand.joint_limits.mean(axis=1)
    for step in range(100):
        swing = 0.5 - 0.5 * np.cos(2 * np.pi * step / 50)  # at 1 Hz, from rest
        q = hand.rest_pose + 0.3 * swing * (middle - hand.rest_pose)
        pose.step(np.zeros(hand.joints), q, np.zeros(len(hand.patches), dtype=bool))
        if step > 1:  # the first one is known to start from rest
            np.testing.assert_allclose(pose.angles, q, atol=5e-4)
    assert np.isfinite(pose.covariance).all()
    assert np.isfinite(pose.log_evidence)


@pytest.mark.parametrize(("name", "heavy"), [("myo", 3), ("adroit", 2), ("two_finger", 0)])
def test_less_is_left_out_of_the_steps_of_a_joint_that_bears_a_hand(name, heavy):
    """The wrist of a whole hand is heavier than the joints of fingers, for which the usual noise was chosen."""
    hand = hands.make(name)
    light = PoseFilter(hand, sigma=SIGMA, motor_noise=0.1, control_hz=50.0, lag=1).velocity_noise
    np.testing.assert_array_equal(light[heavy:], MODEL_NOISE)
    assert (light[:heavy] < 0.5 * MODEL_NOISE).all()
    low, high = ForwardModel(hand, 50.0).reach(hand.joint_limits[:, 0]), ForwardModel(hand, 50.0).reach(hand.rest_pose)
    np.testing.assert_array_less(0.25 * high, low, "a joint at its limit is no heavier")
    faster = PoseFilter(hand, sigma=SIGMA, motor_noise=0.1, control_hz=100.0, lag=1)
    np.testing.assert_array_equal(faster.velocity_noise, light)


def test_what_is_handed_out_is_a_copy(two_finger):
    pose = _filter(two_finger)
    pose.angles[:] = np.nan
    assert np.isfinite(pose.mean).all()


@pytest.mark.parametrize(
    "name", ["normal_force", "tangential_force", "joint_speed", "normal_speed", "tangential_speed"]
)
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf, "1", None])
def test_impossible_dynamics_are_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} must be a finite number in .* got"):
        ContactDynamics(**{name: value})


def _errors(trials: int, steps: int, seed: int):
    """Ranks in standard normal units, (trials, J): the error of the lagged angles over their SD, on paths which the
    model itself generates: its own steps, motor and velocity noise."""
    hand, rng, lag = hands.make("two_finger"), np.random.default_rng(seed), 5
    middle = hand.joint_limits.mean(axis=1)
    for _ in range(trials):
        pose = _filter(hand, lag=lag)
        state = np.concatenate([hand.rest_pose, np.zeros(8)])
        history, torque = [], np.zeros(8)
        for _ in range(steps):
            # Pushed towards the middle: at a limit nothing is Gaussian.
            torque = 0.8 * torque + 0.1 * rng.standard_normal(8)
            command = np.clip(torque + 0.5 * (middle - state[:8]), -1, 1)
            prediction = pose.model.predict(state, command * (1 + 0.1 * rng.standard_normal(8)))
            state = prediction.state.copy()
            state[8:] += VELOCITY_NOISE * rng.standard_normal(8)
            history.append(state[:8].copy())
            felt = state[:8] + SIGMA * rng.standard_normal(8)
            pose.step(command, felt, np.zeros(len(hand.patches), dtype=bool))
        for ago in (0, lag):
            where = pose.lagged(ago)
            sd = np.sqrt(np.diag(pose.covariance)[where])
            yield ago, (history[-1 - ago] - pose.mean[where]) / sd


def test_ninety_per_cent_intervals_hold_the_truth_nine_times_in_ten():
    errors = list(_errors(trials=60, steps=40, seed=0))
    for ago in (0, 5):
        inside = np.abs([error for when, error in errors if when == ago]) < stats.norm.ppf(0.95)
        assert 0.85 < inside.mean() < 0.95  # 480 intervals of 8 joints: SD 0.014, were they independent


@pytest.mark.statistical
def test_simulation_based_calibration():
    """Rank histograms of every joint are flat (Talts et al. 2018, arXiv:1804.06788)."""
    errors = list(_errors(trials=1500, steps=40, seed=1))
    for ago in (0, 5):
        ranks = stats.norm.cdf([error for when, error in errors if when == ago])
        for joint in range(ranks.shape[1]):
            counts = np.histogram(ranks[:, joint], 10, (0, 1))[0]
            assert stats.chisquare(counts).pvalue > 1e-4 / ranks.shape[1], f"joint {joint}, lag {ago}: {counts}"
        inside = np.abs(ranks - 0.5) < 0.45
        assert 0.88 < inside.mean() < 0.92


def test_many_contacts_put_together_say_what_they_say_one_by_one(monkeypatch):
    hand = many_patches()
    rng = np.random.default_rng(0)
    contacts = rng.random(len(hand.patches)) < 0.2
    told = []
    for most in (0, 10**6):
        monkeypatch.setattr(contact_dynamics, "MANY", most)
        pose = _filter(hand, lag=1)
        for step in range(3):
            pose.step(np.full(8, 0.3), hand.rest_pose + 0.02 * step, contacts)
        told.append((pose.mean, pose.covariance, pose.log_evidence))
    for together, apart in zip(*told, strict=True):
        np.testing.assert_allclose(together, apart, rtol=1e-6, atol=1e-12)
    assert np.count_nonzero(contacts) > 200


@pytest.mark.parametrize("value", [-1.0, 0.0, 1e-300, 1e300, np.nan, "1", None, 1j])
@pytest.mark.parametrize("name", ["normal_speed", "tangential_speed"])
def test_speeds_of_skin_whose_squares_are_no_numbers_are_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} must be a finite number in .* m/s, got"):
        ContactDynamics(**{name: value})


def test_numbers_of_any_kind_are_made_plain():
    """What is given to kernels is typed by them."""
    made = ContactDynamics(normal_force=Fraction(1, 2), normal_speed=np.float32(0.25), joint_speed=3)
    assert (made.normal_force, made.normal_speed, made.joint_speed) == (0.5, 0.25, 3.0)
    assert {type(each) for each in (made.normal_force, made.normal_speed, made.joint_speed)} == {float}
    assert type(ContactModel(hit=Fraction(1, 8)).hit) is float
    assert type(SmoothMotion(speeds=[np.float32(1), 2]).speeds[0]) is float


@pytest.mark.filterwarnings("ignore:joint:RuntimeWarning")
def test_a_step_in_one_call_is_the_step_by_parts(hand):
    one, parts = _filter(hand), _filter(hand)
    if one._usual is None:
        pytest.skip("motors that contact may stop unfelt: no step of this hand is taken in one call")
    parts._usual = None
    rng = np.random.default_rng(5)
    for step in range(9):
        torque = rng.uniform(-0.5, 0.5, hand.joints)
        felt = one.angles + SIGMA * rng.standard_normal(hand.joints)
        felt[0] += 3.0 * (step == 5)  # which no hand can have moved by
        contacts = rng.random(len(hand.patches)) < 0.1 * (step % 3)
        for each in (one, parts):
            each.step(torque, felt, contacts)
        np.testing.assert_array_equal(one.mean, parts.mean)
        np.testing.assert_array_equal(one.covariance, parts.covariance)
        assert one.log_evidence == parts.log_evidence
        np.testing.assert_array_equal(one.set_aside, parts.set_aside)
    assert one.set_aside[0] == 1
