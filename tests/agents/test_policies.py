"""Every registered policy: seeded, in bounds, used as Stable-Baselines3's are; and what each is known for."""

from __future__ import annotations

import functools
import inspect

import gymnasium as gym
import numpy as np
import pytest
from scipy import stats

import agents
import haptic_env
from agents.sb3 import SHIPPED
from observer import HapticSLAM, ObserverWrapper, ShapePosterior

WITHOUT_CHANCE = ("reflexes", "searched", "sweep", "trained", "whole_hand")


def watched(env: gym.Env, shape: ShapePosterior | None = None) -> ObserverWrapper:
    """`env` with an observer beside it, which policies may ask; `shape` is of its hand."""
    hand = env.unwrapped.hand
    return ObserverWrapper(env, HapticSLAM(hand, particles=1, lag=2), shape or ShapePosterior(hand, samples=4))


@functools.cache
def about_a_cube(env_id: str) -> ObserverWrapper:
    """One for all tests, each of which begins with a reset."""
    return watched(gym.make(env_id, shape="cube"))


@pytest.fixture(params=[(env_id, name) for env_id in haptic_env.ENVIRONMENTS for name in agents.POLICIES], ids=str)
def pair(request: pytest.FixtureRequest):
    """Every policy with every environment, as (environment, name)."""
    env_id, name = request.param
    env = about_a_cube(env_id)
    try:
        agents.make(name, env)
    except ValueError as error:
        if "was trained for another hand" not in str(error):
            raise
        pytest.skip(f"the model that ships is for another hand than {env_id}")
    return env, name


@pytest.fixture
def env():
    """The two-finger hand about a cube."""
    made = gym.make("HapticSLAM/TwoFinger-v0", shape="cube")
    yield made
    made.close()


def _play(policy: agents.Policy, env: gym.Env, steps: int, **keywords) -> np.ndarray:
    observation, _ = env.reset(seed=0)
    state, actions = None, []
    for _ in range(steps):
        action, state = policy.predict(observation, state, **keywords)
        actions.append(action)
        observation = env.step(action)[0]
    return np.array(actions)


def test_actions_lie_in_the_space(pair):
    env, name = pair
    observation, _ = env.reset(seed=0)
    policy, state = agents.make(name, env, seed=0), None
    for _ in range(200 if env.unwrapped.hand.joints <= 8 else 80):
        action, state = policy.predict(observation, state)
        assert action.dtype == np.float32
        assert action in env.action_space
        observation = env.step(action)[0]


def test_the_same_seed_is_the_same_bits(pair):
    env, name = pair
    first, second, other = (_play(agents.make(name, env, seed=seed), env, 30) for seed in (3, 3, 4))
    assert first.tobytes() == second.tobytes()
    assert (first.tobytes() != other.tobytes()) == (name not in WITHOUT_CHANCE)


class Replay(gym.Env):
    """What was felt once, felt again whatever is commanded, of an object that is nowhere to be found."""

    def __init__(self, env: gym.Env, felt: list) -> None:
        self.action_space, self.observation_space = env.action_space, env.observation_space
        self.hand, self.control_hz, self.felt = env.unwrapped.hand, env.unwrapped.control_hz, felt
        self.episode_seconds = env.unwrapped.episode_seconds

    def reset(self, *, seed=None, options=None):
        self.left = iter(self.felt)
        return next(self.left), {}

    def step(self, action):
        return next(self.left), 0.0, False, False, {}


def test_no_policy_reads_the_truth(pair):
    """Where there is no object, no state and no truth, the same is felt and the same is done."""
    env, name = pair
    policy, state = agents.make(name, env, seed=0), None
    felt, done = [env.reset(seed=0)[0]], []
    for _ in range(40):
        action, state = policy.predict(felt[-1], state)
        felt.append(env.step(action)[0])
        done.append(action)
    blind = watched(Replay(env, felt), env.shape)  # which a reset starts afresh
    again = _play(agents.make(name, blind, seed=0), blind, len(done))
    np.testing.assert_array_equal(again, done)


def test_actions_share_no_memory(pair):
    env, name = pair
    observation, _ = env.reset(seed=0)
    policy, state, kept = agents.make(name, env, seed=0), None, []
    for _ in range(3):
        action, state = policy.predict(observation, state)
        kept.append(action)
    assert not any(np.shares_memory(kept[i], kept[j]) for i in range(3) for j in range(i))


def test_a_policy_is_used_as_a_trained_one(pair):
    """The loop of Stable-Baselines3's documentation for policies with a state."""
    env, name = pair
    policy = agents.make(name, env, seed=0)
    observation, _ = env.reset(seed=0)
    state, episode_start = None, np.ones((1,), dtype=bool)
    for _ in range(20):
        action, state = policy.predict(observation, state=state, episode_start=episode_start, deterministic=False)
        observation, _, terminated, truncated, _ = env.step(action)
        episode_start = np.array([terminated or truncated])
        assert not episode_start.any()


def test_predict_has_the_parameters_of_stable_baselines3(pair):
    env, name = pair
    parameters = inspect.signature(agents.make(name, env).predict).parameters
    assert list(parameters) == ["observation", "state", "episode_start", "deterministic"]
    assert [each.default for each in parameters.values()][1:] == [None, None, False]


def test_an_episodes_start_forgets_the_state(pair):
    env, name = pair
    observation, _ = env.reset(seed=0)
    fresh, restarted = agents.make(name, env, seed=5), agents.make(name, env, seed=5)
    _, state = agents.make(name, env, seed=6).predict(observation)
    expected, _ = fresh.predict(observation)
    for start in (True, np.array([True])):
        action, _ = restarted.predict(observation, state, episode_start=start)
        np.testing.assert_array_equal(action, expected)
        restarted = agents.make(name, env, seed=5)


def test_unknown_policy_lists_the_known(env):
    with pytest.raises(
        ValueError, match=r"unknown policy 'random_torques' \(did you mean 'random_torque'\?\)"
    ) as error:
        agents.make("random_torques", env)
    assert all(name in str(error.value) for name in agents.POLICIES)


def test_the_path_of_a_model_stands_for_a_name():
    assert agents.find(str(SHIPPED)) is agents.POLICIES["sb3"]
    with pytest.raises(ValueError, match=r"--policy must be .* a model that exists, got 'nowhere\.zip'"):
        agents.find("nowhere.zip", "--policy")


def test_unknown_keyword_lists_the_known(pair):
    env, name = pair
    with pytest.raises(ValueError, match=f"unknown {name} policy keyword 'tempo'.*choose from"):
        agents.make(name, env, tempo=3)


@pytest.mark.parametrize("keyword", ["sd", "seconds"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, "1", None])
def test_random_torque_refuses_impossible_numbers(env, keyword, value):
    with pytest.raises(ValueError, match=f"{keyword} must be a finite number in .* got"):
        agents.make("random_torque", env, **{keyword: value})


@pytest.mark.parametrize(
    ("name", "keyword"),
    [
        ("contour_following", "seconds"),
        ("enclosure", "grip"),
        ("enclosure", "seconds"),
        ("information_gain", "candidates"),
        ("information_gain", "horizon"),
        ("information_gain", "seconds"),
        ("synergy", "flexion"),
        ("synergy", "sd"),
        ("synergy", "seconds"),
        ("synergy", "synergies"),
    ],
)
@pytest.mark.parametrize("value", [-2, np.nan, "1"])
def test_impossible_numbers_are_refused(name, keyword, value):
    with pytest.raises(ValueError, match=f"{keyword} must be .* got"):
        agents.make(name, about_a_cube("HapticSLAM/TwoFinger-v0"), **{keyword: value})


def test_random_torques_are_smooth_in_time(env):
    actions = _play(agents.make("random_torque", env, seed=0), env, 500)
    assert np.median(np.abs(np.diff(actions, axis=0))) < 0.2
    assert np.corrcoef(actions[:-1].ravel(), actions[1:].ravel())[0, 1] > 0.9
    assert actions.std() > 0.5, "yet they use the range of the motors"


def test_random_torques_forget_exponentially_and_independently(env):
    """Before squashing: an Ornstein–Uhlenbeck process of unit SD and time constant `seconds`, one per joint."""
    seconds, steps = 0.2, 6000
    policy, state, drives = agents.make("random_torque", env, seed=1, seconds=seconds), None, []
    for _ in range(steps):
        action, state = policy.predict(None, state)
        drives.append(np.arctanh(action.astype(float)))
    drives = np.array(drives)
    independent = drives[::50]  # one second apart
    for joint in range(drives.shape[1]):
        assert stats.kstest(independent[:, joint], "norm").pvalue > 1e-4
        others = range(joint)
        assert all(stats.pearsonr(independent[:, joint], independent[:, other]).pvalue > 1e-4 for other in others)
    for lag in (1, 5, 20):
        correlation = np.mean(drives[:-lag] * drives[lag:])
        assert correlation == pytest.approx(np.exp(-lag * 0.02 / seconds), abs=0.05)


def test_random_torque_is_the_same_process_at_any_control_rate():
    slow, fast = (
        agents.make("random_torque", gym.make("HapticSLAM/TwoFinger-v0", control_hz=hz), seed=0) for hz in (50.0, 500.0)
    )
    assert slow.drive.decay == pytest.approx(fast.drive.decay**10)


def test_deterministic_random_torque_dies_out(env):
    policy = agents.make("random_torque", env, seed=0)
    _, state = policy.predict(None)
    for _ in range(500):
        action, state = policy.predict(None, state, deterministic=True)
    np.testing.assert_allclose(action, 0.0, atol=1e-6)


def test_an_unseeded_policy_is_different_each_time(env):
    first, second = (agents.make("random_torque", env).predict(None)[0] for _ in range(2))
    assert (first != second).any()


class _Broken(agents.Policy):
    """Commands what no motor can do."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.full(self.joints, np.nan, np.float32), None


def test_torques_that_are_not_finite_are_told_with_the_policys_name(env, monkeypatch):
    monkeypatch.setitem(agents.POLICIES, "broken", _Broken)
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match=r"policy .broken. commands torques that are not finite: .nan"):
        agents.act(agents.make("broken", env), observation)


class _Guided(agents.Guided):
    """Commands the first probability of a name."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.full(self.joints, self.shape.posterior[0] * self.belief.n_eff, np.float32), None


def test_a_guided_policy_reads_beliefs_through_further_wrappers(env):
    hand = env.unwrapped.hand
    with pytest.raises(ValueError, match=r"guided by beliefs.*wrap it: ObserverWrapper"):
        _Guided(env)
    wrapped = gym.wrappers.RecordEpisodeStatistics(ObserverWrapper(env, HapticSLAM(hand, particles=2)))
    with pytest.raises(ValueError, match=r"nothing infers here; wrap .* ShapePosterior"):
        agents.act(_Guided(wrapped), wrapped.reset(seed=0)[0])
    wrapped = gym.wrappers.RecordEpisodeStatistics(
        ObserverWrapper(env, HapticSLAM(hand, particles=2), ShapePosterior(hand))
    )
    observation, info = wrapped.reset(seed=0)
    action, _ = agents.act(_Guided(wrapped), observation)
    np.testing.assert_allclose(action, 2 * info["posterior"][0])
