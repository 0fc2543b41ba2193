"""Sensor models: each samples what it scores, independently across joints and steps.

Shapes: T steps, J joints, P patches. Every seed is fixed; of the some hundred p-values each is asked to exceed 1e-4.
"""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import integrate, stats

from haptic_env import sensors
from haptic_env.sensors.gaussian import log_normal

STEP = 0.02  # seconds
T, J = 4000, 4
ANGLES = np.array([-0.4, 0.1, 0.8, 1.5])
UNLIKELY = 1e-4

NOISES = {
    "white": lambda: [sensors.White(3.0)],
    "bias": lambda: [sensors.Bias(3.0)],
    "drift": lambda: [sensors.Drift(3.0, 0.5, STEP)],
    "proportional": lambda: [sensors.Proportional(0.1)],
    "sum": lambda: [
        sensors.White(3.0),
        sensors.Bias(2.0),
        sensors.Drift(1.0, 0.5, STEP),
        sensors.Proportional(0.1),
    ],
}
SD = {  # (J,) rad
    "white": np.full(J, np.deg2rad(3.0)),
    "bias": np.full(J, np.deg2rad(3.0)),
    "drift": np.full(J, np.deg2rad(3.0)),
    "proportional": 0.1 * np.abs(ANGLES),
    "sum": np.sqrt(np.deg2rad(3.0) ** 2 + np.deg2rad(2.0) ** 2 + np.deg2rad(1.0) ** 2 + (0.1 * ANGLES) ** 2),
}


def _errors(noises, seed: int, steps: int = T, episodes: int = 1) -> np.ndarray:
    """Errors (episodes, steps, J) of the felt angles."""
    model, rng = sensors.Proprioception(noises), np.random.default_rng(seed)
    errors = np.empty((episodes, steps, J))
    for episode in errors:
        model.reset(rng, J)
        episode[:] = [model.sample(rng, ANGLES) - ANGLES for _ in range(steps)]
    return errors


def _uncorrelated(first: np.ndarray, second: np.ndarray) -> bool:
    return stats.pearsonr(first, second).pvalue > UNLIKELY


@pytest.mark.parametrize("name", NOISES)
def test_errors_over_episodes_are_normal_with_the_sd_that_is_told(name):
    errors = _errors(NOISES[name](), seed=1, steps=1, episodes=2000)[:, 0]
    for joint in range(J):
        assert stats.kstest(errors[:, joint], "norm", args=(0.0, SD[name][joint])).pvalue > UNLIKELY
    variance = sum(noise.variance(ANGLES) for noise in NOISES[name]())
    np.testing.assert_allclose(np.sqrt(variance), SD[name])


@pytest.mark.parametrize("name", NOISES)
def test_errors_of_different_joints_are_independent(name):
    errors = _errors(NOISES[name](), seed=2, steps=1, episodes=2000)[:, 0]
    for first in range(J):
        assert all(_uncorrelated(errors[:, first], errors[:, second]) for second in range(first))


@pytest.mark.parametrize("name", ["white", "proportional"])
def test_white_errors_of_different_steps_are_independent(name):
    errors = _errors(NOISES[name](), seed=3)[0]
    for joint in range(J):
        assert stats.kstest(errors[:, joint], "norm", args=(0.0, SD[name][joint])).pvalue > UNLIKELY
        assert all(_uncorrelated(errors[:-lag, joint], errors[lag:, joint]) for lag in (1, 2, 5, 50))


def test_bias_is_constant_within_an_episode_and_fresh_in_the_next():
    errors = _errors(NOISES["bias"](), seed=4, steps=10, episodes=500)
    assert np.ptp(errors, axis=1).max() < 1e-12
    assert all(_uncorrelated(errors[:-1, 0, joint], errors[1:, 0, joint]) for joint in range(J))


def test_drift_forgets_exponentially():
    """The autocorrelation of an Ornstein–Uhlenbeck process at a lag t is exp(-t / tau)."""
    errors = _errors(NOISES["drift"](), seed=5, steps=60, episodes=1500)
    for lag in (1, 5, 25, 50):
        pairs = stats.pearsonr(errors[:, 5].ravel(), errors[:, 5 + lag].ravel())
        low, high = pairs.confidence_interval(1 - UNLIKELY)
        assert low < np.exp(-lag * STEP / 0.5) < high


def test_drift_does_not_depend_on_the_control_rate():
    slow, fast = sensors.Drift(3.0, 0.5, 0.02), sensors.Drift(3.0, 0.5, 0.002)
    assert slow.decay == pytest.approx(fast.decay**10)


@pytest.mark.parametrize("name", NOISES)
def test_log_prob_is_that_of_the_normal_and_integrates_to_one(name):
    model = sensors.Proprioception(NOISES[name]())
    felt = ANGLES + np.array([0.01, -0.03, 0.02, 0.1])
    expected = stats.norm.logpdf(felt, ANGLES, SD[name]).sum()
    assert model.log_prob(felt, ANGLES) == pytest.approx(expected)
    angle, sd = ANGLES[2:3], SD[name][2]
    total, _ = integrate.quad(
        lambda x: np.exp(model.log_prob(np.array([x]), angle)), angle[0] - 10 * sd, angle[0] + 10 * sd
    )
    assert total == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("name", NOISES)
def test_what_is_sampled_is_as_likely_as_its_own_score_says(name):
    """The mean score of the samples is minus the entropy; a sampler and a score that drifted apart fail."""
    model, rng = sensors.Proprioception(NOISES[name]()), np.random.default_rng(6)
    scores = []
    for _ in range(3000):
        model.reset(rng, J)
        scores.append(model.log_prob(model.sample(rng, ANGLES), ANGLES))
    negative_entropy = -stats.norm.entropy(scale=SD[name]).sum()
    assert stats.ttest_1samp(scores, negative_entropy).pvalue > UNLIKELY


def test_no_noise_is_the_true_angle_and_certain():
    model, rng = sensors.Proprioception([sensors.White(0.0), sensors.Bias(0.0)]), np.random.default_rng(0)
    model.reset(rng, J)
    np.testing.assert_array_equal(model.sample(rng, ANGLES), ANGLES)
    assert model.log_prob(ANGLES, ANGLES) == 0.0
    assert model.log_prob(ANGLES + 1e-9, ANGLES) == -np.inf


def test_sampling_leaves_its_input_alone_and_shares_no_memory():
    for build in NOISES.values():
        model, rng, angles = sensors.Proprioception(build()), np.random.default_rng(0), ANGLES.copy()
        model.reset(rng, J)
        first = model.sample(rng, angles)
        kept = first.copy()
        second = model.sample(rng, angles)
        first[:] = 0.0
        np.testing.assert_array_equal(angles, ANGLES)
        assert not np.shares_memory(first, second)
        assert kept.shape == (J,)


def test_a_point_mass_beside_a_density():
    assert log_normal(np.array([1.0, 0.2]), np.array([1.0, 0.0]), np.array([0.0, 0.5])) == pytest.approx(
        stats.norm.logpdf(0.2, 0.0, 0.5)
    )


@pytest.mark.parametrize(("miss", "false_alarm"), [(0.0, 0.0), (0.1, 0.02), (1.0, 1.0), (0.5, 0.0)])
def test_contacts_are_missed_and_invented_as_often_as_told(miss, false_alarm):
    detection, rng = sensors.ContactDetection(miss, false_alarm), np.random.default_rng(7)
    touched = np.arange(50) < 20
    reported = np.array([detection.sample(rng, touched) for _ in range(500)])
    assert reported.dtype == bool
    for real, chance in ((touched, 1 - miss), (~touched, false_alarm)):
        rings = reported[:, real]
        assert stats.binomtest(int(rings.sum()), rings.size, chance).pvalue > UNLIKELY
        if 0 < chance < 1:
            assert _uncorrelated(rings[:-1].ravel(), rings[1:].ravel())
            assert _uncorrelated(rings[:, :-1].ravel(), rings[:, 1:].ravel())


def test_perfect_detection_reports_a_copy():
    touched = np.array([True, False])
    reported = sensors.ContactDetection().sample(np.random.default_rng(0), touched)
    np.testing.assert_array_equal(reported, touched)
    assert not np.shares_memory(reported, touched)


@pytest.mark.parametrize(("miss", "false_alarm"), [(0.0, 0.0), (0.1, 0.02), (0.4, 0.3)])
@pytest.mark.parametrize("touch", [0.0, 0.3, 1.0])
def test_contact_log_prob_sums_to_one_over_all_reports(miss, false_alarm, touch):
    detection = sensors.ContactDetection(miss, false_alarm)
    probability = np.array([touch, 0.7])
    reports = np.array(np.meshgrid([False, True], [False, True])).reshape(2, -1).T
    assert sum(np.exp(detection.log_prob(report, probability)) for report in reports) == pytest.approx(1.0)
    ring = np.exp(detection.log_prob(np.array([True]), np.array([touch])))
    assert ring == pytest.approx((1 - miss) * touch + false_alarm * (1 - touch))


def test_contact_samples_are_as_likely_as_their_own_score_says():
    detection, rng = sensors.ContactDetection(0.2, 0.05), np.random.default_rng(8)
    touched = np.arange(10) < 4
    scores = [detection.log_prob(detection.sample(rng, touched), touched.astype(float)) for _ in range(3000)]
    entropy = 4 * stats.bernoulli(0.2).entropy() + 6 * stats.bernoulli(0.05).entropy()
    assert stats.ttest_1samp(scores, -entropy).pvalue > UNLIKELY


def test_an_impossible_report_has_no_probability():
    assert sensors.ContactDetection().log_prob(np.array([True]), np.array([0.0])) == -np.inf


@pytest.mark.parametrize("fraction", [0.1, 0.3])
def test_motor_noise_grows_with_the_command(fraction):
    motor, rng = sensors.MotorNoise(fraction), np.random.default_rng(9)
    command = np.array([-1.0, -0.2, 0.5, 1.0])
    torques = np.array([motor.sample(rng, command) for _ in range(T)])
    for joint in range(J):
        sd = fraction * abs(command[joint])
        assert stats.kstest(torques[:, joint], "norm", args=(command[joint], sd)).pvalue > UNLIKELY
        assert _uncorrelated(torques[:-1, joint], torques[1:, joint])
        assert all(_uncorrelated(torques[:, joint], torques[:, other]) for other in range(joint))
    scores = [motor.log_prob(torque, command) for torque in torques]
    assert scores[0] == pytest.approx(stats.norm.logpdf(torques[0], command, fraction * np.abs(command)).sum())
    assert stats.ttest_1samp(scores, -stats.norm.entropy(scale=fraction * np.abs(command)).sum()).pvalue > UNLIKELY


def test_a_silent_motor_is_exact():
    motor, rng = sensors.MotorNoise(0.1), np.random.default_rng(0)
    np.testing.assert_array_equal(motor.sample(rng, np.zeros(3)), 0.0)
    np.testing.assert_array_equal(sensors.MotorNoise(0.0).sample(rng, np.ones(3)), 1.0)
    assert motor.log_prob(np.zeros(3), np.zeros(3)) == 0.0


BUILD = {
    "sigma_deg": sensors.White,
    "bias_deg": sensors.Bias,
    "drift_deg": lambda value: sensors.Drift(value, 1.0, STEP),
    "drift_seconds": lambda value: sensors.Drift(1.0, value, STEP),
    "proportional": sensors.Proportional,
    "motor_noise": sensors.MotorNoise,
    "contact_miss": sensors.ContactDetection,
    "contact_false_alarm": lambda value: sensors.ContactDetection(0.0, value),
}


@pytest.mark.parametrize("name", BUILD)
@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf, "3", None, True, [1.0]], ids=str)
def test_impossible_parameters_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"{name} must be a finite number in .*, got {re.escape(repr(value))}"):
        BUILD[name](value)


@pytest.mark.parametrize("wrong", [np.full(4, np.nan), np.full(4, 1e300), np.zeros(3), ["a"] * 4, np.zeros(4, complex)])
@pytest.mark.parametrize(
    ("score", "names"),
    [
        (sensors.Proprioception([sensors.White(3.0)]).log_prob, ("felt", "joint_angles")),
        (sensors.MotorNoise(0.1).log_prob, ("torque", "command")),
        (sensors.ContactDetection(0.1, 0.1).log_prob, ("contacts", "touch_probability")),
    ],
)
def test_what_cannot_have_been_sensed_has_no_probability(score, names, wrong):
    for name in names:
        with pytest.raises(ValueError, match=" must "):
            score(**{**dict.fromkeys(names, np.zeros(4)), name: wrong})


@pytest.mark.parametrize("step_seconds", [0.0, -1.0, np.nan, None])
def test_drift_between_steps_that_take_no_time_is_refused(step_seconds):
    with pytest.raises(ValueError, match="step_seconds must be a finite number"):
        sensors.Drift(1.0, 10.0, step_seconds)


@pytest.mark.parametrize("kinds", [(), ("bias",), ("drift",), ("bias", "drift"), ("proportional",)])
def test_the_offset_is_what_was_felt_too_much_at_the_last_step(kinds) -> None:
    noises = [noise for kind in kinds for noise in NOISES[kind]()]
    felt = sensors.FeltAngles(sensors.Proprioception(noises), np.random.default_rng(2), J)
    first = felt.offset
    for step in range(20):
        error = felt(ANGLES) - ANGLES
        if "proportional" in kinds:
            assert not felt.offset.any()
            continue
        np.testing.assert_allclose(error, felt.offset, atol=1e-6)
        if step == 0:
            np.testing.assert_array_equal(felt.offset, first)
    assert felt.offset.any() == bool({"bias", "drift"} & {*kinds})
