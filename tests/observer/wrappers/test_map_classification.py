"""A classifier of maps beside an environment, while the hand explores."""

from __future__ import annotations

from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from sklearn.dummy import DummyClassifier
from sklearn.linear_model import LogisticRegression

from observer import HapticSLAM, ObserverWrapper, PoseOnly, ShapePosterior
from observer.classifiers import CLASSIFIERS, MapClassifier, NearestNeighbour, make
from observer.variants import NAMES, WITHOUT_MAP, make_observer

STEPS = 33
NAMED = ("ball", "box")


@pytest.fixture(scope="module")
def maps(two_finger):
    """Two maps: nothing is known, and a block is."""
    empty = np.full(HapticSLAM(two_finger).grid.shape, 0.5)
    block = empty.copy()
    block[12:20, 12:20, 12:20] = 0.9
    return [empty, block]


def _watched(observer, **keywords) -> ObserverWrapper:
    inner = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=STEPS / 50)
    return ObserverWrapper(inner, observer, **keywords)


def _run(env):
    """Every info of an episode, and the map at each of its steps."""
    env.action_space.seed(1)
    infos, drawn = [env.reset(seed=3)[1]], [env.map_now()]
    for _ in range(STEPS):
        infos.append(env.step(env.action_space.sample())[-1])
        drawn.append(env.map_now())
    return infos, drawn


@pytest.mark.parametrize("name", CLASSIFIERS)
def test_the_map_is_named_every_so_many_steps_and_at_the_end(two_finger, maps, name):
    classifier = make(name).fit(maps, NAMED)
    env = _watched(HapticSLAM(two_finger, 3.0, 4), classifier=classifier, classify_every=8)
    infos, drawn = _run(env)
    asked = [*range(0, STEPS, 8), STEPS]
    for step, info in enumerate(infos):
        last = max(each for each in asked if each <= step)
        np.testing.assert_array_equal(info["map_posterior"], classifier.predict_proba(drawn[last]))
        assert info["map_posterior"].shape == classifier.classes_.shape
    np.testing.assert_array_equal(drawn[-1], infos[-1]["belief"].occupancy)
    assert not np.array_equal(drawn[8], drawn[-1])
    env.close()


def test_who_names_the_map_changes_no_belief(two_finger, maps, bits):
    classifier = NearestNeighbour("squared").fit(maps, NAMED)
    with_one, without = (
        _run(_watched(HapticSLAM(two_finger, 3.0, 4), shape=ShapePosterior(two_finger), **told))[0]
        for told in ({"classifier": classifier, "classify_every": 1}, {})
    )
    for one, other in zip(with_one, without, strict=True):
        assert set(one) - set(other) == {"map_posterior"}
        assert bits(one["belief"]) == bits(other["belief"])
        np.testing.assert_array_equal(one["posterior"], other["posterior"])


def test_what_is_handed_out_stays_as_it_is(two_finger, maps):
    env = _watched(HapticSLAM(two_finger, 3.0, 4), classifier=NearestNeighbour("squared").fit(maps, NAMED))
    _, info = env.reset(seed=0)
    kept = info["map_posterior"].copy()
    info["map_posterior"][:] = 7.0
    np.testing.assert_array_equal(env.step(np.zeros(8))[-1]["map_posterior"], kept)
    drawn = env.map_now()
    drawn[:] = 0.3
    assert (env.map_now() != 0.3).all()
    env.close()


@pytest.mark.parametrize("name", [name for name in NAMES if name not in (*WITHOUT_MAP, "second_look")])  # takes 20 s
def test_any_observer_with_a_map_may_be_asked(two_finger, maps, name):
    env = _watched(make_observer(name, two_finger, 3.0, 4), classifier=NearestNeighbour().fit(maps, NAMED))
    infos, drawn = _run(env)
    assert infos[-1]["map_posterior"].sum() == pytest.approx(1.0)
    assert (drawn[-1] != 0.5).any()
    env.close()


def test_the_next_episode_begins_with_the_empty_map(two_finger, maps):
    env = _watched(HapticSLAM(two_finger, 3.0, 4), classifier=NearestNeighbour("squared").fit(maps, NAMED))
    first, _ = _run(env)
    second, drawn = _run(env)
    np.testing.assert_array_equal(drawn[0], 0.5)
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one["map_posterior"], other["map_posterior"])
    env.close()


def test_vectors_of_environments_stack_what_is_named(two_finger, maps):
    classifier = NearestNeighbour("squared").fit(maps, NAMED)

    def wrap(env: gym.Env) -> gym.Env:
        return ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, 3.0, 2), classifier=classifier)

    envs = gym.make_vec(
        "HapticSLAM/TwoFinger-v0", num_envs=2, vectorization_mode="sync", wrappers=[wrap], episode_seconds=0.1
    )
    _, info = envs.reset(seed=0)
    for _ in range(7):  # past the end of an episode
        assert info["map_posterior"].shape == (2, 2)
        np.testing.assert_allclose(info["map_posterior"].sum(axis=1), 1.0)
        *_, info = envs.step(envs.action_space.sample())
    envs.close()


def test_without_a_map_the_last_beliefs_is_drawn(two_finger):
    env = _watched(PoseOnly(two_finger))
    with pytest.raises(ValueError, match=r"no map before the first reset; call reset\(\) first"):
        env.map_now()
    env.reset(seed=0)
    np.testing.assert_array_equal(env.map_now(), 0.5)
    env.close()


def _says(answer, classes=NAMED):
    return SimpleNamespace(classes_=classes, predict_proba=lambda map: answer)


class Wordy(MapClassifier):
    """Fails in many lines."""

    def _fit(self, maps, index):
        """Learns nothing."""

    def _predict_proba(self, map):
        raise RuntimeError("out\nof\norder")


BAD = {
    "not fitted": (lambda maps: NearestNeighbour(), "this NearestNeighbour is not fitted yet: call fit"),
    "an estimator, not fitted": (lambda maps: LogisticRegression(), "LogisticRegression is not fitted yet"),
    "an estimator of flat maps": (
        lambda maps: LogisticRegression().fit([each.ravel() for each in maps], NAMED),
        r"ScikitLearn takes estimators\); this LogisticRegression fails on an empty map: .*dim 3",
    ),
    "of rows, whatever they are": (
        lambda maps: DummyClassifier().fit([each.ravel() for each in maps], NAMED),
        r"this DummyClassifier fails .* finite numbers of shape \(2,\), got shape \(32, 2\)",
    ),
    "of another grid": (
        lambda maps: NearestNeighbour().fit([each[:5] for each in maps], NAMED),
        r"map must be of shape \(5, 32, 32\) as those it was fitted on, got \(32, 32, 32\)",
    ),
    "a name": (lambda maps: "nearest_neighbour", "classifier must be a fitted one .*got 'nearest_neighbour'"),
    "a class": (lambda maps: NearestNeighbour, "classifier must be a fitted one .*NearestNeighbour"),
    "a number": (lambda maps: 3, "classifier must be a fitted one .*, or None, got 3"),
    "without classes": (
        lambda maps: _says([1.0], []),
        r"classes_ of the classifier must be one name or more, got \[\]",
    ),
    "one class": (lambda maps: _says([1.0], "ball"), "classes_ of the classifier must be names, got 'ball'"),
    "the same class twice": (lambda maps: _says([0.5, 0.5], ["box", "box"]), "must be names, all different, got"),
    "more answers than classes": (lambda maps: _says([0.2, 0.3, 0.5]), r"of shape \(2,\), got shape \(3,\)"),
    "no numbers": (lambda maps: _says([np.nan, 0.5]), r"predict_proba says must be finite .*nan"),
    "no probabilities": (lambda maps: _says([0.2, 0.3]), r"probabilities that add up to 1, got \[0.2, 0.3\]"),
    "nothing": (lambda maps: _says(None), r"finite numbers of shape \(2,\), got None"),
    "what fails": (lambda maps: Wordy().fit(maps, NAMED), "this Wordy fails on an empty map: out of order"),
}


@pytest.mark.parametrize("kind", BAD)
def test_what_is_no_fitted_classifier_is_refused_at_once_in_a_line(two_finger, maps, kind):
    make_bad, told = BAD[kind]
    with pytest.raises(ValueError, match=told) as refused:
        _watched(HapticSLAM(two_finger, 3.0, 2), classifier=make_bad(maps))
    assert "\n" not in str(refused.value)


def test_an_observer_without_a_map_is_refused(two_finger, maps):
    with pytest.raises(ValueError, match=r"needs an observer that has one \(map_now\), such as a HapticSLAM, got .*Po"):
        _watched(PoseOnly(two_finger), classifier=NearestNeighbour().fit(maps, NAMED))


@pytest.mark.parametrize("every", [0, -3, 2.5, "often", True, None])
def test_an_interval_is_a_step_at_least(two_finger, every):
    with pytest.raises(ValueError, match="classify_every must be an integer"):
        _watched(PoseOnly(two_finger), classify_every=every)
