"""Observers that doubt what patches report: those with a map and those without, of every hand."""

from __future__ import annotations

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest

import haptic_env
from haptic_env import sensors
from observer import HapticSLAM, PoseOnly, ShapePosterior

OBSERVERS = {"slam": HapticSLAM, "pose": PoseOnly}
FEW = {"slam": {"particles": 8}, "pose": {}}
BELIEFS = {
    "misses": {"contact_miss": 0.2},
    "false alarms": {"contact_false_alarm": 0.002},
    "confusion": {"contact_confusion": 0.2},
    "stuck": {"patches_stuck": 0.002},
    "dead": {"patches_dead": [3]},
    "all": {
        "contact_miss": 0.2,
        "contact_false_alarm": 0.002,
        "contact_confusion": 0.2,
        "patches_stuck": 0.01,
        "patches_dead": 0.01,
    },
}


@pytest.fixture(params=OBSERVERS)
def kind(request):
    """Each observer that doubts contacts."""
    return request.param


def _turns(trial):
    return list(zip(trial.torque, trial.felt, trial.contacts, strict=True))


def _believe(observer, turns):
    beliefs = [observer.reset(seed=0)]
    for turn in turns:
        beliefs.append(observer.step(*turn))
    return [*beliefs, *observer.flush()]


def test_contacts_that_are_not_doubted_are_what_is_reported(explore, kind, bits):
    trial = explore("cube", 40, seed=3)
    zero = {"contact_miss": 0.0, "contact_false_alarm": 0, "contact_confusion": 0.0, "patches_stuck": []}
    plain, told = (_believe(OBSERVERS[kind](trial.hand, **FEW[kind], **each), _turns(trial)) for each in ({}, zero))
    assert [bits(each) for each in plain] == [bits(each) for each in told]
    for now, belief in enumerate(plain[:41]):
        np.testing.assert_array_equal(belief.patch_reliability, 1.0)
        if belief.lagged_contacts is not None:
            np.testing.assert_array_equal(belief.lagged_contacts, trial.contacts[now - 1 - belief.lag_steps])


def test_faults_that_are_thought_possible_change_nothing_where_all_patches_work(explore, kind, bits):
    """Patches that were silent once are not stuck, and those that touch are not dead."""
    trial = explore("cube", 40, seed=3)
    plain, told = (
        _believe(OBSERVERS[kind](trial.hand, **FEW[kind], **each), _turns(trial))
        for each in ({}, {"patches_stuck": 0.01, "patches_dead": 0.001})
    )
    felt = trial.contacts.any(axis=0)
    assert (told[-1].patch_reliability[felt] == 1.0).all()
    assert (told[-1].patch_reliability[~felt] < 1.0).all()
    for one, other in zip(plain, told, strict=True):
        assert {**bits(one), "patch_reliability": b""} == {**bits(other), "patch_reliability": b""}


def test_a_patch_that_is_stuck_is_set_aside(explore, kind):
    trial = explore("cube", 60, seed=3, patches_stuck=(21,))
    beliefs = _believe(OBSERVERS[kind](trial.hand, **FEW[kind], patches_stuck=0.002), _turns(trial))
    assert trial.contacts[:, 21].all()
    assert beliefs[0].patch_reliability[21] == 0.998
    assert beliefs[-1].patch_reliability[21] < 0.01
    assert not any(each.lagged_contacts[21] for each in beliefs if each.lagged_contacts is not None)


@pytest.mark.parametrize("belief", BELIEFS)
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))], ids=["deep", "pickle"])
def test_a_copy_goes_on_as_the_original(explore, kind, bits, belief, copied):
    trial = explore("cube", 40, seed=3)
    observer = OBSERVERS[kind](trial.hand, **FEW[kind], **BELIEFS[belief])
    observer.reset(seed=0)
    kept = [observer.step(*turn) for turn in _turns(trial)[:25]][-1]
    before, twin = kept.patch_reliability.copy(), copied(observer)
    for turn in _turns(trial)[25:]:
        assert bits(observer.step(*turn)) == bits(twin.step(*turn))
    assert [bits(each) for each in observer.flush()] == [bits(each) for each in twin.flush()]
    np.testing.assert_array_equal(kept.patch_reliability, before)
    assert bits(observer.reset(seed=1)) == bits(twin.reset(seed=1))


@pytest.mark.parametrize("lag", [0, 3])
def test_any_lag_will_do(explore, lag):
    trial = explore("cube", 25, seed=3)
    beliefs = _believe(HapticSLAM(trial.hand, particles=4, lag=lag, **BELIEFS["all"]), _turns(trial))
    assert len(beliefs) == 26 + max(lag, 1)  # the map in hindsight is told of anyway
    assert all(np.isfinite(each.joint_angles).all() for each in beliefs)


def test_known_solids_are_felt_with_what_is_touched(explore):
    trial = explore("cube", 40, seed=3, patches_stuck=(2,))
    solids = ShapePosterior(trial.hand)
    observer = HapticSLAM(trial.hand, particles=4, patches_stuck=0.002, solids=solids)
    assert all(np.isfinite(each.lagged_joint_angles).all() for each in _believe(observer, _turns(trial)))


@pytest.mark.parametrize("env_id", haptic_env.ENVIRONMENTS)
def test_an_observer_for_an_environment_believes_what_is_so(env_id, kind):
    told = {"sigma_deg": 2.0, "bias_deg": 1.0, "contact_miss": 0.1, "contact_confusion": 0.1, "patches_stuck": [1]}
    env = gym.make(env_id, control_hz=25.0, **told)
    observation, _ = env.reset(seed=0)
    observer = OBSERVERS[kind].for_env(gym.Wrapper(env), **FEW[kind])
    base = env.unwrapped
    assert observer.hand is base.hand
    assert (observer.control_hz, observer.sigma_deg) == (25.0, pytest.approx(2.0))
    same = OBSERVERS[kind](base.hand, control_hz=25.0, **FEW[kind], **base.noise)
    for each in (observer, same):
        each.reset(seed=0)
    for _ in range(12):
        torque = env.action_space.sample()
        observation, *_ = env.step(torque)
        beliefs = [each.step(torque, observation["joint_angles"], observation["contacts"]) for each in (observer, same)]
        assert beliefs[0] == beliefs[1]
    assert beliefs[0].patch_reliability[1] == 0.0
    assert beliefs[0].joint_offset_std.all()
    assert OBSERVERS[kind].for_env(env, sigma_deg=5.0).sigma_deg == pytest.approx(5.0)


def test_an_environment_without_a_hand_is_refused(kind):
    with pytest.raises(ValueError, match="env must be one environment with a hand"):
        OBSERVERS[kind].for_env(gym.make("CartPole-v1"))


BAD = {
    "contact_miss": (-0.1, 1.1, np.nan, "x", None),
    "contact_false_alarm": (-0.1, 1.1, np.nan, "x", None),
    "contact_confusion": (-0.1, 1.1, np.nan, "x", None),
    "patches_stuck": (-0.1, 1.1, np.nan, "x", None, [50], ["x"], [-1], [True]),
    "patches_dead": (-0.1, 1.1, np.nan, "x", None, [50], ["x"], [-1], [True]),
}


@pytest.mark.parametrize(("name", "value"), [(name, value) for name in BAD for value in BAD[name]], ids=str)
def test_what_cannot_be_believed_is_refused_as_by_the_environment(two_finger, kind, name, value):
    with pytest.raises(ValueError, match=name) as told:
        OBSERVERS[kind](two_finger, **{name: value})
    with pytest.raises(ValueError, match=name) as environments:
        gym.make("HapticSLAM/TwoFinger-v0", **{name: value})
    assert str(told.value) == str(environments.value)
    assert name in sensors.KEYWORDS


def test_an_environment_whose_noise_is_not_known_is_refused(kind):
    env = gym.Wrapper(gym.make("HapticSLAM/TwoFinger-v0"))
    del env.unwrapped.noise
    with pytest.raises(ValueError, match=r"noise of env must be known, as that of HapticSLAM/TwoFinger-v0, got None"):
        OBSERVERS[kind].for_env(env)


def test_where_a_patch_is_doubted_something_may_press_unfelt(two_finger):
    """Its finger's pose is less sure, that of the other as it was."""
    filters = [PoseOnly(two_finger).pose for _ in range(2)]
    filters[1].doubted = np.arange(len(two_finger.patches)) == two_finger.patches.names.index("index_distal_tip")
    for _ in range(3):
        for each in filters:
            each.step(np.zeros(8), two_finger.rest_pose, np.zeros(len(two_finger.patches), dtype=bool))
    usual, doubted = (np.diag(each.covariance)[:8] for each in filters)
    index = np.array([name.startswith("index") for name in two_finger.joint_names])
    assert (doubted[index][1:] > usual[index][1:]).all()
    np.testing.assert_array_equal(doubted[~index], usual[~index])
