"""A copied or pickled observer goes on as the original would, bit for bit, and so do all that are made of it."""

from __future__ import annotations

import copy
import itertools
import pickle

import gymnasium as gym
import numpy as np
import pytest

import agents
from observer import (
    BeliefObservation,
    DecideWhenSure,
    DecisionReward,
    HapticSLAM,
    ObserverWrapper,
    ShapePosterior,
    classifiers,
)
from observer.variants import NAMES, make_observer

COPIES = {"deepcopy": copy.deepcopy, "pickle": lambda it: pickle.loads(pickle.dumps(it))}


@pytest.fixture(params=COPIES)
def copied(request):
    """Each way to copy."""
    return COPIES[request.param]


@pytest.fixture
def trial(explore):
    """Two fingers about a cube, which they touch."""
    return explore("cube", 40, seed=3)


def _turns(trial, first: int, last: int):
    return list(zip(trial.torque, trial.felt, trial.contacts, strict=True))[first:last]


ALL_WAYS = ("haptic_slam", "paper", "kalman")  # the other variants are made of the same parts
WAYS = [
    (name, way, kept)
    for name in NAMES
    for way, kept in itertools.product(COPIES, (True, False))
    if name in ALL_WAYS or (way == "deepcopy") == kept
]


@pytest.mark.parametrize(("name", "way", "kept"), WAYS)
def test_an_observer_copied_in_mid_trial_goes_on_as_the_original(trial, bits, name, way, kept):
    """Whether beliefs are kept or not."""
    copied = COPIES[way]
    observer = make_observer(name, trial.hand, 3.0, 8)
    beliefs = [observer.reset(seed=0)]
    for turn in _turns(trial, 0, 25):
        beliefs.append(observer.step(*turn))
        if not kept:
            beliefs.clear()
    before = [bits(copy.copy(belief)) for belief in beliefs[:5]]
    twin = copied(observer)
    first, second = ([bits(each.step(*turn)) for turn in _turns(trial, 25, 40)] for each in (observer, twin))
    assert first == second
    assert [bits(belief) for belief in observer.flush()] == [bits(belief) for belief in twin.flush()]
    assert [bits(belief) for belief in beliefs[:5]] == before
    assert bits(observer.reset(seed=1)) == bits(twin.reset(seed=1))
    turn = _turns(trial, 0, 1)[0]
    assert bits(observer.step(*turn)) == bits(twin.step(*turn))


def test_a_copy_is_apart(trial, bits, copied):
    """What is told to it is no matter of the original's."""
    observer, other = (HapticSLAM(trial.hand, particles=8) for _ in range(2))
    for each in (observer, other):
        each.reset(seed=0)
        for turn in _turns(trial, 0, 20):
            each.step(*turn)
    twin = copied(observer)
    for turn in _turns(trial, 0, 15):
        twin.step(*turn)
    for turn in _turns(trial, 20, 40):
        assert bits(observer.step(*turn)) == bits(other.step(*turn))


def test_a_belief_is_copied_with_its_map(trial, bits, copied):
    observer = HapticSLAM(trial.hand, particles=8, lag=2)
    observer.reset(seed=0)
    kept = [observer.step(*turn) for turn in _turns(trial, 0, 20)][-1]
    twin = copied(kept)
    for turn in _turns(trial, 20, 40):
        observer.step(*turn)
    assert bits(twin) == bits(kept)


@pytest.mark.parametrize("keywords", [{}, {"samples": 8, "none": 0.1}, {"size_jitter": 0.1, "variants": 10}], ids=str)
def test_a_namer_copied_in_mid_trial_goes_on_as_the_original(trial, copied, keywords):
    beliefs = trial.beliefs(make_observer("kalman", trial.hand, 3.0, 1))
    namer = ShapePosterior(trial.hand, **keywords)
    namer.reset(seed=0)
    for belief in beliefs[:20]:
        namer.update(belief)
    twin = copied(namer)
    for belief in beliefs[20:]:
        np.testing.assert_array_equal(namer.update(belief), twin.update(belief))
    np.testing.assert_array_equal(namer.log_likelihood, twin.log_likelihood)


def test_an_observer_that_knows_the_solids_goes_on_as_the_original(trial, bits, copied):
    observer = HapticSLAM(trial.hand, particles=4, solids=ShapePosterior(trial.hand))
    observer.reset(seed=0)
    for turn in _turns(trial, 0, 25):
        observer.step(*turn)
    twin = copied(observer)
    first, second = ([bits(each.step(*turn)) for turn in _turns(trial, 25, 40)] for each in (observer, twin))
    assert first == second


@pytest.mark.parametrize("name", [name for name in agents.POLICIES if name not in ("sb3", "searched", "trained")])
def test_all_that_explore_together_go_on_as_the_originals(bits, copied, name):
    """The environment, its wrappers, the observer, the namer, the policy and its state, copied at once."""
    inner = gym.make("HapticSLAM/TwoFinger-v0", size_jitter=0.1, episode_seconds=1.0, reveal_truth=True)
    hand = inner.unwrapped.hand
    env = ObserverWrapper(inner, HapticSLAM(hand, particles=4, lag=3), ShapePosterior(hand))
    env = DecisionReward(DecideWhenSure(env, 0.999))
    policy, state = agents.make(name, env, seed=1), None  # which reads what is felt, not the features
    env = BeliefObservation(env)
    env.reset(seed=2)
    for _ in range(15):
        action, state = policy.predict(_felt(env), state)
        env.step(action)
    twins = copied((env, policy, state))
    assert _run(bits, env, policy, state) == _run(bits, *twins)


def _run(bits, env: gym.Env, policy: agents.Policy, state) -> list:
    """On to the end of the episode, and into the next one."""
    run = []
    for step in range(40):
        if step == 35:
            env.reset()
            state = None
        action, state = policy.predict(_felt(env), state)
        seen, reward, ended, cut, info = env.step(action)
        run.append((action.tobytes(), seen.tobytes(), reward, ended, cut, bits(info["belief"])))
    return run


def _felt(env: gym.Env) -> dict:
    """What the hand feels now, whatever wrappers tell."""
    base = env.unwrapped
    return {"joint_angles": base._data.qpos.astype(np.float32), "contacts": base._touched.astype(np.int8)}


@pytest.mark.parametrize("name", classifiers.CLASSIFIERS)
def test_a_fitted_classifier_can_be_copied(copied, name):
    maps = np.random.default_rng(0).uniform(0, 1, (4, 6, 6, 6))
    fitted = classifiers.make(name).fit(maps, ["a", "b", "a", "b"])
    twin = copied(fitted)
    for each in maps:
        np.testing.assert_array_equal(fitted.predict_proba(each), twin.predict_proba(each))
