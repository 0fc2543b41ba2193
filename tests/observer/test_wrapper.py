"""The observer beside an environment."""

from __future__ import annotations

import multiprocessing
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import haptic_env
from observer import Belief, HapticSLAM, ObserverWrapper
from observer.variants import NAMES, make_observer
from tests.observer.hands import pointer


@pytest.fixture(params=list(haptic_env.ENVIRONMENTS))
def env(request: pytest.FixtureRequest):
    """Every registered environment, short, with an observer."""
    made = watched(gym.make(request.param, shape="cube", episode_seconds=0.5, reveal_truth=True))
    yield made
    made.close()


def watched(env: gym.Env) -> ObserverWrapper:
    """`env` with an observer of its hand."""
    return ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, particles=4, lag=3))


def test_gymnasiums_checker_passes_without_a_warning(env):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
        # Gymnasium asks for the bare environment and warns of any wrapper; all else holds for it as well.
        warnings.filterwarnings("ignore", message=".*is different from the unwrapped version.*")
        check_env(env, skip_render_check=True, skip_close_check=True)  # which makes a second one of its specification


def test_stable_baselines3s_checker_passes_without_a_warning(env):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(env, skip_render_check=True)


def test_a_belief_beside_every_observation(env):
    observation, info = env.reset(seed=0)
    assert isinstance(info["belief"], Belief)
    for _ in range(2):
        assert (info["belief"].occupancy == 0.5).all()
        steps, truncated = 0, False
        while not truncated:
            observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
            assert isinstance(info["belief"], Belief)
            assert set(info) == {"belief", "truth"}, "what was in it stays in it"
            assert observation in env.observation_space
            assert reward == 0.0
            assert not terminated
            steps += 1
            assert info["belief"].lag_steps == (0 if truncated else min(steps, 3)), "the end is flushed"
        assert steps == 25
        with pytest.raises(ValueError, match=r"call reset\(\)"):
            env.step(env.action_space.sample())
        observation, info = env.reset()


def test_the_belief_is_that_of_the_observer_alone(env, bits):
    env.action_space.seed(0)
    observation, info = env.reset(seed=7)
    through, steps = [info["belief"]], []
    for _ in range(25):
        action = env.action_space.sample()
        observation, *_, info = env.step(action)
        through.append(info["belief"])
        steps.append((action, observation["joint_angles"], observation["contacts"]))
    slam = HapticSLAM(env.unwrapped.hand, particles=4, lag=3)
    alone = [slam.reset(seed=int(np.random.SeedSequence(7).generate_state(1)[0]))]
    alone += [slam.step(*each) for each in steps]
    alone[-1] = slam.flush()[-1]
    assert [bits(belief)["particles"] for belief in through] == [bits(belief)["particles"] for belief in alone]
    assert bits(through[-1]) == bits(alone[-1])


def test_the_same_seed_is_the_same_belief(env, bits):
    runs = []
    for _ in range(2):
        env.action_space.seed(0)
        env.reset(seed=3)
        for _ in range(25):
            info = env.step(env.action_space.sample())[-1]
        runs.append(bits(info["belief"]))
    assert runs[0] == runs[1]


def test_reset_options_pass_through(env):
    env.reset(seed=0, options={"shape": "sphere"})
    assert env.unwrapped.solid.name == "sphere"


@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")  # of Python 3.12
@pytest.mark.parametrize(
    ("mode", "keywords"),
    [("sync", None), *(("async", {"context": context}) for context in multiprocessing.get_all_start_methods())],
    ids=str,
)
def test_vectors_of_watched_environments(mode, keywords):
    """`gym.make_vec` with the wrapper: one observer in each environment, however its process is started."""
    envs = gym.make_vec(
        "haptic_env:HapticSLAM/TwoFinger-v0",
        num_envs=2,
        vectorization_mode=mode,
        vector_kwargs=keywords,
        wrappers=[watched],
        episode_seconds=0.2,
    )
    try:
        observation, info = envs.reset(seed=[1, 2])
        assert len(info["belief"]) == 2
        for _ in range(12):  # past the end of an episode
            observation, _, _, _, info = envs.step(envs.action_space.sample())
        assert observation["joint_angles"].shape == (2, 8)
        assert all(isinstance(belief, Belief) for belief in info["belief"])
        assert info["belief"][0].joint_angles.tobytes() != info["belief"][1].joint_angles.tobytes()
    finally:
        envs.close()


def test_any_observer_may_watch():
    for name in NAMES:
        inner = gym.make("HapticSLAM/TwoFinger-v0", episode_seconds=0.1)
        env = ObserverWrapper(inner, make_observer(name, inner.unwrapped.hand, 3.0, 4))
        env.reset(seed=0)
        for _ in range(5):
            info = env.step(env.action_space.sample())[-1]
        assert isinstance(info["belief"], Belief)
        env.close()


@pytest.mark.parametrize("other", ["two_finger", "pointer"])
def test_an_observer_of_another_hand_is_refused(other):
    inner = gym.make("HapticSLAM/TwoFinger-v0", patches_around=6)
    hand = pointer() if other == "pointer" else gym.make("HapticSLAM/TwoFinger-v0").unwrapped.hand
    with pytest.raises(ValueError, match=rf"knows hand '{hand.name}' with {len(hand.patches)} patches.*'two_finger'"):
        ObserverWrapper(inner, HapticSLAM(hand, particles=4))
    inner.close()
