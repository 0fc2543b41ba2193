"""Readings that no hand can give: set aside, or taken without whole turns; else nothing changes, not a bit."""

from __future__ import annotations

import functools
import itertools
import warnings

import numpy as np
import pytest

from haptic_env import hands
from observer import DeadReckoning, HapticSLAM, PoseOnly
from observer.pose import gating, kalman_updates
from observer.pose.gating import Gate, Heard, take_in
from observer.pose.kalman_updates import Measurement
from observer.variants import make_observer
from tests.observer.hands import pointer

OBSERVERS = {
    "pose_only": lambda hand, sigma: PoseOnly(hand, sigma),
    "kalman": lambda hand, sigma: make_observer("kalman", hand, sigma, 1),
    "smoother": lambda hand, sigma: make_observer("smoother", hand, sigma, 1),
    "haptic_slam": lambda hand, sigma: HapticSLAM(hand, sigma, 8),
    "kinematic": lambda hand, sigma: HapticSLAM(hand, sigma, 2, motion="kinematic"),
    "delta_pose": lambda hand, sigma: HapticSLAM(hand, sigma, 2, motion="delta_pose"),
}
AT, JOINT = 30, 2  # the step and the joint of what is odd


@functools.cache
def _observer(name, sigma):
    """Each made once: what it learns in a trial ends with its reset."""
    return OBSERVERS[name](hands.make("two_finger"), sigma)


def _told(observer, trial, change=lambda step, angles: None):
    """Beliefs of every step, what is felt being changed in place before."""
    beliefs = [observer.reset(seed=0, joint_angles=trial.hand.rest_pose)]
    for step, (torque, felt, contacts) in enumerate(zip(trial.torque, trial.felt, trial.contacts, strict=True)):
        angles = felt.astype(np.float64)
        change(step, angles)
        beliefs.append(observer.step(torque, angles, contacts))
    return beliefs


def _spike(size, steps=(AT,), joints=(JOINT,)):
    def change(step, angles):
        if step in steps:
            for joint in joints:
                angles[joint] = np.clip(angles[joint] + size, -12.56, 12.56)

    return change


NOISES = {"sigma_deg": 1.0}, {"sigma_deg": 5.0}, {"sigma_deg": 1.0, "bias_deg": 3.0}
SAME_FILTER = ("kalman", "smoother")  # as pose_only's, so that less of them tells enough
USUAL = [
    pytest.param(name, shape, noise, marks=[pytest.mark.statistical] if name in SAME_FILTER and more else [])
    for name in OBSERVERS
    for more, (shape, noise) in enumerate(itertools.product(("cube", "sphere"), NOISES))
]


@pytest.mark.parametrize(("name", "shape", "keywords"), USUAL, ids=str)
def test_where_no_reading_is_odd_nothing_changes(explore, bits, monkeypatch, name, shape, keywords):
    trial = explore(shape, 100, seed=7, **keywords)
    observer = _observer(name, keywords["sigma_deg"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with_gate = [bits(belief) for belief in _told(observer, trial)]
    assert not observer.set_aside.any()
    monkeypatch.setattr(Gate, "judge", lambda *_: None)
    monkeypatch.setattr(Gate, "lost", lambda *_: False)
    assert [bits(belief) for belief in _told(observer, trial)] == with_gate


ODD = {
    "a spike within the range": _spike(-1.5),
    "a spike beyond the range": _spike(5.0),
    "a spike as far as can be told": _spike(30.0),
    "a spike of all joints": _spike(-8.0, joints=range(8)),
    "three in a row": _spike(3.0, steps=(AT, AT + 1, AT + 2)),
    "a wrong turn": _spike(2 * np.pi),
    "two wrong turns": _spike(-4 * np.pi),
    "a turn too many from then on": _spike(2 * np.pi, steps=range(AT, 1000)),
    "a turn too few from the start": _spike(-2 * np.pi, steps=range(1000)),
    "spikes now and then": _spike(4.0, steps=range(3, 60, 9)),
}


@pytest.fixture(scope="module")
def usual(explore):
    """The beliefs of an observer where nothing is odd, made once."""

    @functools.cache
    def told(name, sigma):
        trial = explore("cube", 100, seed=3, sigma_deg=sigma)
        return _told(_observer(name, sigma), trial)

    return told


WITH_SIGMA = [
    pytest.param(name, sigma, marks=[pytest.mark.statistical] if name in SAME_FILTER and sigma != 1.0 else [])
    for name in OBSERVERS
    for sigma in (1.0, 5.0)
]


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")
@pytest.mark.parametrize("case", ODD)
@pytest.mark.parametrize(("name", "sigma"), WITH_SIGMA)
def test_what_is_odd_does_no_lasting_harm(explore, usual, name, sigma, case):
    trial = explore("cube", 100, seed=3, sigma_deg=sigma)
    observer = _observer(name, sigma)
    usual = usual(name, sigma)
    odd = _told(observer, trial, ODD[case])
    assert observer.set_aside[JOINT] > 0
    for attribute in ("joint_angles", "joint_std", "lagged_joint_angles"):
        first, last = (getattr(told[-1], attribute) for told in (usual, odd))
        np.testing.assert_allclose(first, last, atol=np.deg2rad(0.1 + 0.05 * sigma))
    worst = max(np.abs(a.joint_angles - b.joint_angles).max() for a, b in zip(usual, odd, strict=True))
    assert worst < 1.2, "nor does it while it lasts"


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")
@pytest.mark.parametrize("name", OBSERVERS)
def test_whole_turns_are_taken_away_exactly(explore, name):
    trial = explore("cube", 60, seed=3)
    observer = _observer(name, 3.0)
    usual = _told(observer, trial)
    odd = _told(observer, trial, _spike(2 * np.pi, steps=range(AT, 1000)))
    np.testing.assert_array_equal(observer.set_aside, 30 * (np.arange(8) == JOINT))
    np.testing.assert_allclose(usual[-1].joint_angles, odd[-1].joint_angles, atol=1e-9)
    np.testing.assert_allclose(usual[-1].log_evidence, odd[-1].log_evidence, rtol=1e-9)


@pytest.mark.parametrize("name", OBSERVERS)
def test_it_is_said_once_a_trial_and_counted(explore, name):
    trial = explore("cube", 60, seed=3)
    observer = _observer(name, 3.0)
    joint = trial.hand.joint_names[JOINT]
    for _ in range(2):
        with pytest.warns(
            RuntimeWarning, match=rf"joint '{joint}' was felt at .* where it cannot be \(it turns"
        ) as told:
            _told(observer, trial, _spike(5.0, steps=(AT, AT + 10)))
        assert len(told) == 1
        np.testing.assert_array_equal(observer.set_aside, 2 * (np.arange(8) == JOINT))
    observer.reset(seed=0)
    assert not observer.set_aside.any()


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")
@pytest.mark.parametrize("name", ["pose_only", "kinematic", "delta_pose"])
def test_what_persists_is_believed(explore, name):
    """Then it was the filter that was wrong: of where the hand began, say."""
    trial = explore("cube", 100, seed=3)
    observer = _observer(name, 3.0)
    beliefs = _told(observer, trial, _spike(1.9, steps=range(AT, 1000)))
    assert 0 < observer.set_aside[JOINT] <= 2 * gating.IN_A_ROW
    last, first = AT + gating.IN_A_ROW - 1, AT + gating.IN_A_ROW  # set aside, and believed
    assert abs(beliefs[last + 1].joint_angles[JOINT] - trial.true[last, JOINT]) < 0.3
    assert abs(beliefs[first + 1].joint_angles[JOINT] - trial.felt[first, JOINT] - 1.9) < 0.1


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")
def test_a_joint_that_is_no_longer_felt_becomes_unsure(explore):
    """A dead sensor, which says what cannot be."""
    trial = explore("cube", 100, seed=3)
    observer = PoseOnly(trial.hand, 3.0)
    usual = _told(observer, trial)[-1].joint_std

    def dead(step, angles):
        if step >= AT:
            angles[JOINT] = 9.0

    odd = _told(observer, trial, dead)[-1].joint_std
    assert observer.set_aside[JOINT] == 100 - AT
    assert odd[JOINT] > 1.3 * usual[JOINT]
    np.testing.assert_allclose(np.delete(odd, JOINT), np.delete(usual, JOINT), rtol=0.5)


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")
@pytest.mark.filterwarnings("ignore:the filter of the pose was lost:RuntimeWarning")
@pytest.mark.parametrize("name", OBSERVERS)
@pytest.mark.parametrize("sigma", [1e-9, 3.0, 90.0])
def test_whatever_is_felt_beliefs_are_numbers(explore, name, sigma):
    """Within what the observation space allows, and with a sigma that has nothing to do with it."""
    trial = explore("cube", 60, seed=3)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        scale = (1.0, 4.0, 4 * np.pi)[seed]
        beliefs = _told(
            _observer(name, sigma),
            trial,
            lambda _, angles, rng=rng, scale=scale: angles.__setitem__(slice(None), rng.uniform(-scale, scale, 8)),
        )
        for belief in beliefs:
            for attribute in ("joint_angles", "joint_std", "lagged_joint_angles", "lagged_covariance", "particles"):
                assert np.isfinite(getattr(belief, attribute)).all(), attribute
            assert np.isfinite(belief.log_evidence)
            assert np.abs(belief.lagged_joint_angles).max() < 4 * np.pi + 8.0
        assert np.isfinite(beliefs[-1].occupancy).all()


def test_the_floor_takes_all_at_its_word(explore):
    trial = explore("cube", 60, seed=3)
    floor = DeadReckoning(trial.hand, 3.0)
    beliefs = _told(floor, trial, _spike(5.0))
    assert beliefs[AT + 1].joint_angles[JOINT] == trial.felt.astype(np.float64)[AT, JOINT] + 5.0
    assert not floor.set_aside.any()


def test_angles_felt_at_a_reset_are_taken_without_whole_turns(two_finger):
    gate = Gate(two_finger, 0.05, 0.02)
    rest = two_finger.rest_pose
    np.testing.assert_array_equal(gate.at_first(rest), rest)
    np.testing.assert_allclose(gate.at_first(rest + 2 * np.pi), rest)
    assert gate.at_first(rest + np.pi) is None
    slam = HapticSLAM(two_finger, particles=1, motion="kinematic")
    usual, turned = (slam.reset(seed=0, joint_angles=rest + turn).joint_angles for turn in (0.0, -2 * np.pi))
    np.testing.assert_allclose(usual, turned)


@pytest.mark.filterwarnings("ignore:joint .* where it cannot be:RuntimeWarning")
def test_joints_without_limits_may_turn_as_often_as_they_like():
    hand = pointer()
    hand.model.jnt_limited[:] = 0
    gate = Gate(hand, 0.01, 0.02)
    assert gate.judge(np.array([11.0]), np.array([10.9]), np.array([1e-4])) is None
    heard = gate.judge(np.array([11.0]), np.array([10.9 - 2 * np.pi]), np.array([1e-4]))
    np.testing.assert_allclose(heard.angles, 11.0 - 2 * np.pi)
    hand.model.jnt_limited[:] = 1


@pytest.mark.parametrize("rows", [0, 3])
def test_taking_in_some_joints_is_to_condition_on_them_alone(rows):
    """Against the filter's kernel with all joints, and against plain algebra with some."""
    rng = np.random.default_rng(rows)
    joints, size = 4, 12
    factor = rng.standard_normal((size, size))
    covariance, mean, felt = factor @ factor.T, rng.standard_normal(size), rng.standard_normal(joints)
    every = Heard(felt, np.arange(joints), np.zeros(joints, bool))
    a, b = (mean.copy(), covariance.copy()), (mean.copy(), covariance.copy())
    white = np.full(joints, 0.3)
    told = kalman_updates.condition(*a, Measurement.nothing(joints), felt, white, 2 * joints, 0)
    assert take_in(*b, every, white) == pytest.approx(told)
    np.testing.assert_allclose(b[0], a[0], rtol=1e-9)
    np.testing.assert_allclose(b[1], a[1], rtol=1e-9, atol=1e-9)
    some = np.array([0, 3])
    c = mean.copy(), covariance.copy()
    take_in(*c, Heard(felt, some, np.zeros(joints, bool)), white)
    gain = covariance[:, some] @ np.linalg.inv(covariance[np.ix_(some, some)] + 0.3 * np.eye(2))
    np.testing.assert_allclose(c[0], mean + gain @ (felt[some] - mean[some]))
    np.testing.assert_allclose(c[1], covariance - gain @ covariance[some], atol=1e-9)
    nobody = mean.copy(), covariance.copy()
    assert take_in(*nobody, Heard(felt, np.zeros(0, np.int64), np.zeros(joints, bool)), white) == 0.0
    np.testing.assert_array_equal(nobody[0], mean)
