"""Errors that last in the filters' state: against the whole joint Gaussian, and as they are drawn."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from haptic_env import sensors
from haptic_env.hands import HANDS
from observer import HapticSLAM
from observer.pose import kalman_updates
from observer.pose.angle_noise import AngleNoise, Offset, summed
from observer.pose.contact_dynamics import ON_A_WRIST, WITH_OFFSETS, ContactDynamics
from observer.pose.delta_pose import DeltaMotion, DeltaPose
from observer.pose.forward_model import ForwardModel
from observer.pose.found_sigma import FoundSigma
from observer.pose.gating import Heard, take_in
from observer.pose.kalman import PoseFilter
from observer.pose.kalman_updates import Measurement
from observer.pose.motions import MOTIONS
from observer.pose_only import PoseOnly
from tests.observer.hands import pointer

STEP = 0.02
SIGMA = np.deg2rad(1.0)
KINDS = {
    "bias": {"bias_deg": 3.0},
    "drift": {"drift_deg": 2.0, "drift_seconds": 0.2},
    "both": {"bias_deg": 3.0, "drift_deg": 2.0, "drift_seconds": 0.2},
}


def _gaussian(rng, size):
    factor = rng.standard_normal((size, size))
    return rng.standard_normal(size), factor @ factor.T


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_believed_is_what_the_sensors_draw(kind):
    """Covariance over time of 4,000 drawn offsets; an SD of 3 % of each number, so five of them."""
    joints, steps = 4000, 6
    noise = AngleNoise(joints, STEP, **KINDS[kind])
    rng = np.random.default_rng(0)
    drawn = sensors.Proprioception(
        [
            sensors.Bias(KINDS[kind].get("bias_deg", 0.0)),
            sensors.Drift(KINDS[kind].get("drift_deg", 0.0), KINDS[kind].get("drift_seconds", 1.0), STEP),
        ]
    )
    felt = sensors.FeltAngles(drawn, rng, joints)
    path = np.array([felt(np.zeros(joints)) for _ in range(steps)])
    of_one = AngleNoise(1, STEP, **KINDS[kind])
    np.testing.assert_allclose(path @ path.T / joints, of_one.over_time(steps), rtol=5 * 0.025)
    assert noise.sd == pytest.approx(np.sqrt(of_one.over_time(1)[0, 0]))
    np.testing.assert_allclose(noise.decay**2 * noise.prior + noise.fresh, noise.prior)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("lag", [0, 1, 4])
@pytest.mark.parametrize("forces", [False, True])
def test_the_kernels_are_one_linear_map_and_one_condition(kind, lag, forces):
    rng = np.random.default_rng(lag)
    joints = 3
    noise = AngleNoise(joints, STEP, **KINDS[kind])
    state, errors = (3 if forces else 2) * joints, len(noise.decay)
    mean, covariance = _gaussian(rng, state + errors + lag * joints)
    transition, predicted = rng.standard_normal((state, state)), rng.standard_normal(state)
    added = np.cov(rng.standard_normal((state, 50)))
    size, present = len(mean), state + errors
    whole, fresh = np.zeros((size, size)), np.zeros((size, size))
    whole[:state, :state] = transition
    whole[range(state, present), range(state, present)] = noise.decay
    whole[present:, :joints][:joints] = np.eye(joints)[: size - present]
    for k in range(present + joints, size):
        whole[k, k - joints] = 1.0
    fresh[:state, :state] = added
    fresh[range(state, present), range(state, present)] = noise.fresh
    expected = whole @ mean
    expected[:state] = predicted
    spread = whole @ covariance @ whole.T + fresh
    kalman_updates.shift(mean, covariance, predicted, transition, added, joints, noise.decay, noise.fresh)
    np.testing.assert_allclose(mean, expected, atol=1e-12)
    np.testing.assert_allclose(covariance, spread, atol=1e-9)

    felt, white = rng.standard_normal(joints), rng.uniform(0.1, 1.0, joints)
    rows = rng.standard_normal((2, 2 * joints))
    measured = np.zeros((2 + joints, size))
    measured[:2, : 2 * joints] = rows
    for part in [slice(0, joints), *noise.kinds(state, joints)]:
        measured[2:, part] = np.eye(joints)
    total = measured @ spread @ measured.T + np.diag([0.3, 0.3, *white])
    gain = spread @ measured.T @ np.linalg.inv(total)
    residual = np.concatenate([[0.0, 0.0], felt]) - measured @ mean
    other = mean.copy(), covariance.copy()
    still = Measurement(rows, np.zeros(2), np.full(2, 0.3))
    kalman_updates.condition(mean, covariance, still, felt, white, state, errors)
    np.testing.assert_allclose(mean, other[0] + gain @ residual, atol=1e-9)
    np.testing.assert_allclose(covariance, spread - gain @ total @ gain.T, atol=1e-9)

    some = np.array([0, 2])
    measured = measured[2:][some]
    total = measured @ spread @ measured.T + np.diag(white[some])
    gain = spread @ measured.T @ np.linalg.inv(total)
    expected = other[0] + gain @ (felt[some] - measured @ other[0])
    take_in(*other, Heard(felt, some, np.zeros(joints, bool)), white, noise.kinds(state, joints))
    np.testing.assert_allclose(other[0], expected, atol=1e-9)
    np.testing.assert_allclose(other[1], spread - gain @ total @ gain.T, atol=1e-9)


@pytest.mark.parametrize("joints", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("start_std_deg", [0.0, 5.0])
def test_a_linear_hand_is_known_as_by_exact_bayes(joints, kind, start_std_deg):
    """All angles and offsets of a trial as one Gaussian, conditioned once on all that is felt."""
    hand, steps = pointer(joints), 12
    noise = AngleNoise(joints, STEP, **KINDS[kind], start_std_deg=start_std_deg)
    pose = DeltaPose(hand, sigma=SIGMA, motor_noise=0.0, control_hz=1 / STEP, lag=steps, noise=noise)
    wander = np.deg2rad(0.7) ** 2
    pose.motion = DeltaMotion(np.zeros((joints, joints)), wander * np.eye(joints))
    felt = np.random.default_rng(3).normal(0.0, 0.05, (steps + 1, joints))
    pose.reset(felt[0])
    for each in felt[1:]:
        pose.step(np.zeros(joints), each, np.zeros(len(hand.patches), bool))
    time = np.arange(steps + 1)
    angles = wander * np.minimum.outer(time, time) + noise.start_variance + 1e-10 * np.eye(steps + 1)
    offsets = AngleNoise(1, STEP, **KINDS[kind]).over_time(steps + 1)
    gain = np.linalg.inv(angles + offsets + SIGMA**2 * np.eye(steps + 1))
    for joint in range(joints):
        q, o = angles @ gain @ felt[:, joint], offsets @ gain @ felt[:, joint]
        for ago in (0, 1, steps):
            assert pose.mean[pose.lagged(ago)][joint] == pytest.approx(q[steps - ago], abs=1e-6)
            variance = pose.covariance.diagonal()[pose.lagged(ago)][joint]
            assert variance == pytest.approx((angles - angles @ gain @ angles)[-1 - ago, -1 - ago], abs=1e-7)
        assert pose.offset.mean[joint] == pytest.approx(o[-1], abs=1e-6)
        assert pose.offset.std[joint] ** 2 == pytest.approx((offsets - offsets @ gain @ offsets)[-1, -1], abs=1e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_offsets_are_calibrated_by_simulation(kind):
    """Simulation-based calibration (Talts et al. 2018, arXiv:1804.06788): worlds drawn from what is believed; the true
    offset's place in its posterior is uniform. 600 places, deciles: χ² with 9 degrees is above 27.9 once in 1,000."""
    hand, steps, joints = pointer(2), 10, 2
    noise = AngleNoise(joints, STEP, **KINDS[kind])
    pose = DeltaPose(hand, sigma=SIGMA, motor_noise=0.0, control_hz=1 / STEP, lag=1, noise=noise)
    wander = np.deg2rad(0.7)
    pose.motion = DeltaMotion(np.zeros((joints, joints)), wander**2 * np.eye(joints))
    rng, places = np.random.default_rng(7), []
    of_one = AngleNoise(1, STEP, **KINDS[kind])
    over_time = np.linalg.cholesky(of_one.over_time(steps + 1) + 1e-14 * np.eye(steps + 1))
    for _ in range(300):
        true = np.cumsum(np.vstack([np.zeros(joints), wander * rng.standard_normal((steps, joints))]), axis=0)
        offset = over_time @ rng.standard_normal((steps + 1, joints))
        felt = true + offset + SIGMA * rng.standard_normal(true.shape)
        pose.reset(felt[0])
        for each in felt[1:]:
            pose.step(np.zeros(joints), each, np.zeros(len(hand.patches), bool))
        places.extend((offset[-1] - pose.offset.mean) / pose.offset.std)
    deciles = np.histogram(places, norm.ppf(np.arange(11) / 10))[0]
    assert ((deciles - 60.0) ** 2 / 60.0).sum() < 27.9


@pytest.mark.parametrize("motion", ["forward_model", "delta_pose", "kinematic", "raw_angles"])
def test_an_offset_that_is_known_to_be_none_changes_nothing(two_finger, motion):
    rng = np.random.default_rng(0)
    with_none = MOTIONS[motion](
        two_finger,
        sigma=SIGMA,
        motor_noise=0.1,
        control_hz=50.0,
        lag=3,
        dynamics=ContactDynamics(),
        noise=AngleNoise(two_finger.joints, STEP, bias_deg=1e-5),
    )
    white = MOTIONS[motion](
        two_finger, sigma=SIGMA, motor_noise=0.1, control_hz=50.0, lag=3, dynamics=ContactDynamics()
    )
    for each in (with_none, white):
        each.velocity_noise = 0.6
        each.reset(two_finger.rest_pose)
    hand, torque = ForwardModel(two_finger, 50.0), rng.uniform(-1, 1, two_finger.joints)
    state, contacts = np.concatenate([two_finger.rest_pose, np.zeros(two_finger.joints)]), np.zeros(50, dtype=bool)
    for _ in range(20):
        state = hand.predict(state, torque).state
        felt = state[: two_finger.joints] + rng.normal(0, SIGMA, two_finger.joints)
        with_none.step(torque, felt, contacts)
        white.step(torque, felt, contacts)
    for ago in (0, 2):
        np.testing.assert_allclose(with_none.mean[with_none.lagged(ago)], white.mean[white.lagged(ago)], atol=1e-6)
        np.testing.assert_allclose(
            with_none.covariance.diagonal()[with_none.lagged(ago)],
            white.covariance.diagonal()[white.lagged(ago)],
            atol=1e-9,
        )
    assert np.abs(with_none.offset.mean).max() < 1e-6
    np.testing.assert_array_equal(white.offset, np.zeros((2, two_finger.joints)))


def _watch(hand, observer, offset, sigma, steps=300, drift=0.0):
    """Beliefs of an `observer` of a hand in free air, driven by random torques, felt with `offset` (J,) rad."""
    rng = np.random.default_rng(11)
    pose = PoseFilter(hand, sigma=sigma, motor_noise=0.0, control_hz=50.0, lag=1)
    state = np.concatenate([hand.rest_pose, np.zeros(hand.joints)])
    belief = observer.reset(0, state[: hand.joints] + offset + rng.normal(0.0, sigma, hand.joints))
    torque = np.zeros(hand.joints)
    for step in range(steps):
        if step % 10 == 0:
            torque = rng.uniform(-1.0, 1.0, hand.joints)
        state = pose.model.predict(state, torque).state
        felt = state[: hand.joints] + offset + rng.normal(0.0, sigma, hand.joints)
        belief = observer.step(torque, felt, np.zeros(len(hand.patches)))
    return state[: hand.joints], belief


@pytest.mark.parametrize("make", [PoseOnly, HapticSLAM])
def test_a_bias_is_found_and_does_not_harm_the_pose(two_finger, make):
    offset = np.deg2rad(3.0) * np.random.default_rng(1).standard_normal(two_finger.joints)
    few = {} if make is PoseOnly else {"particles": 2, "candidates": 2}
    true, belief = _watch(two_finger, make(two_finger, 1.0, bias_deg=3.0, **few), offset, SIGMA)
    away = (belief.joint_offset - offset) / belief.joint_offset_std
    assert np.abs(away).max() < 4.0  # of eight: beyond it once in 2,000
    assert belief.joint_offset_std.max() < np.deg2rad(0.5)  # a sixth of what it was
    _, white = _watch(two_finger, make(two_finger, 1.0, **few), offset, SIGMA)
    assert np.abs(belief.joint_angles - true).mean() < 0.5 * np.abs(white.joint_angles - true).mean()
    np.testing.assert_array_equal(white.joint_offset, 0.0)
    np.testing.assert_array_equal(white.joint_offset_std, 0.0)


@pytest.mark.parametrize("sigma_deg", [0.5, 6.0])
def test_sigma_is_found_out(two_finger, sigma_deg):
    observer = PoseOnly(two_finger, None)
    for _ in range(2):  # anew in every trial
        _watch(two_finger, observer, 0.0, np.deg2rad(sigma_deg), steps=100)
        assert observer.sigma_deg == pytest.approx(sigma_deg, rel=0.15)
    observer.reset(0)
    assert observer.sigma_deg == pytest.approx(3.0)


def test_sigma_that_is_set_is_not_found_out_any_more(two_finger):
    observer = PoseOnly(two_finger, None)
    _watch(two_finger, observer, 0.0, np.deg2rad(0.5), steps=5)
    observer.sigma_deg = 5.0
    observer.step(np.zeros(8), two_finger.rest_pose, np.zeros(50))
    assert observer.sigma_deg == pytest.approx(5.0)
    _watch(two_finger, observer, 0.0, np.deg2rad(0.5), steps=5)
    assert observer.sigma_deg == pytest.approx(5.0)


def test_sigma_told_before_a_reset_holds_after_it(two_finger):
    observer = PoseOnly(two_finger, 3.0)
    observer.sigma_deg = 5.0
    observer.reset(0)
    assert observer.sigma_deg == pytest.approx(5.0)


def test_a_start_that_is_not_known_is_felt(two_finger):
    away = two_finger.rest_pose + 0.1
    told, untold = (PoseOnly(two_finger, 1.0, start_std_deg=10.0).reset(0, q) for q in (away, None))
    np.testing.assert_allclose(told.joint_angles, away, atol=0.01)
    assert (told.joint_std < np.deg2rad(1.01)).all()
    np.testing.assert_allclose(untold.joint_std, np.deg2rad(10.0))
    known = PoseOnly(two_finger, 1.0).reset(0, away)
    np.testing.assert_array_equal(known.joint_angles, two_finger.rest_pose)


def test_noise_in_proportion_to_the_angle_weighs_less_where_it_is_larger():
    noise = AngleNoise(3, STEP, proportional=0.1)
    np.testing.assert_allclose(
        noise.variance(0.02, np.array([0.0, 1.0, -2.0]), np.array([0.0, 0.0, 1.0])),
        0.02**2 + 0.01 * np.array([0.0, 1.0, 5.0]),
    )
    assert noise.lasting == ()


def test_sums_of_parts_are_those_of_the_whole():
    rng = np.random.default_rng(2)
    mean, covariance = _gaussian(rng, 8)
    parts = [slice(0, 2), slice(4, 6), slice(6, 8)]
    rows = sum(np.eye(8)[part] for part in parts)
    total, variance = summed(mean, covariance, parts)
    np.testing.assert_allclose(total, rows @ mean)
    np.testing.assert_allclose(variance, (rows @ covariance @ rows.T).diagonal())
    np.testing.assert_array_equal(Offset.of(mean, covariance, [], 2), np.zeros((2, 2)))


def test_sigma_of_exact_residuals_is_their_rms():
    found = FoundSigma()
    residual = np.random.default_rng(0).normal(0.0, 0.2, 20_000)
    found.learn(residual, np.zeros(20_000))
    assert found.sigma == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize("name", HANDS)
def test_forces_last_only_where_offsets_are_believed(name):
    hand = HANDS[name]()
    white, biased = (
        PoseFilter(
            hand, sigma=SIGMA, motor_noise=0.1, control_hz=50.0, lag=1, noise=AngleNoise(hand.joints, STEP, **kind)
        )
        for kind in ({}, KINDS["bias"])
    )
    assert white.dynamics == (ON_A_WRIST if hand.wrist.size else ContactDynamics())
    assert biased.dynamics == WITH_OFFSETS
    for pose in (white, biased):
        assert pose.lagged(1) == slice(len(pose.mean) - hand.joints, len(pose.mean))
        pose.step(np.zeros(hand.joints), hand.rest_pose, np.ones(len(hand.patches), bool))
        assert np.linalg.eigvalsh(pose.covariance).min() > -1e-9


def test_what_is_pushed_off_its_limit_is_not_taken_for_an_offset(two_finger):
    """A joint held at its limit by its torque, and pushed off it for twenty steps."""
    joint = two_finger.joint_names.index("index_dip_flexion")
    observer = PoseOnly(two_finger, 1.0, bias_deg=3.0)
    torque, felt = np.zeros(two_finger.joints), two_finger.rest_pose.copy()
    torque[joint] = -1.0
    contacts = two_finger.patches.link == len(two_finger.links) - 1
    rng = np.random.default_rng(0)
    belief = observer.reset(0, felt)
    for step in range(60):
        felt[joint] = two_finger.joint_limits[joint, 0] + np.deg2rad(1.0) * max(0, step - 40)
        noisy = felt + rng.normal(0.0, SIGMA, two_finger.joints)
        belief = observer.step(torque, noisy, contacts if step > 40 else np.zeros(len(contacts)))
    assert np.abs(belief.joint_offset[joint]) < np.deg2rad(1.0)
    assert np.abs(belief.joint_angles - felt)[joint] < np.deg2rad(3.0)
