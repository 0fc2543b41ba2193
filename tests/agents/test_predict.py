"""What may be asked of any policy: one observation or several at once, and nothing that no environment has given."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import agents
from agents.repeat_torques import RepeatTorques
from observer import BeliefObservation, ObserverWrapper, PoseOnly, ShapePosterior

READING = [name for name, kind in agents.POLICIES.items() if not kind.blind]
GUIDED = [name for name, kind in agents.POLICIES.items() if kind.guided]
ALONE = [name for name, kind in agents.POLICIES.items() if not kind.guided]  # without beliefs
DRAWS_NOTHING = ("reflexes", "sweep", "whole_hand")


def watched(seconds: float = 0.2) -> gym.Env:
    """The two-finger hand about a cube, with an observer."""
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=seconds)
    hand = env.unwrapped.hand
    return ObserverWrapper(env, PoseOnly(hand), ShapePosterior(hand, samples=4))


@pytest.fixture(scope="module")
def env():
    """One for all tests, each of which begins with a reset."""
    made = watched()
    yield made
    made.close()


def _stacked(*observations: dict) -> dict:
    return {name: np.stack([each[name] for each in observations]) for name in observations[0]}


@pytest.mark.parametrize("name", agents.POLICIES)
def test_stable_baselines3_evaluates_it(env, name):
    evaluation = pytest.importorskip("stable_baselines3.common.evaluation")
    policy = agents.make(name, env, seed=0)
    rewards, lengths = evaluation.evaluate_policy(policy, env, 2, return_episode_rewards=True, warn=False)
    assert (rewards, lengths) == ([0.0, 0.0], [10, 10])


@pytest.mark.parametrize("name", agents.POLICIES)
def test_one_that_is_stacked_is_answered_as_one(env, name):
    observation, _ = env.reset(seed=0)
    alone, stacked = agents.make(name, env, seed=0), agents.make(name, env, seed=0)
    state, states = None, None
    for step in range(12):
        action, state = alone.predict(observation, state, np.array([step == 6]))
        actions, states = stacked.predict(_stacked(observation), states, np.array([step == 6]))
        assert actions.shape == (1, 8)
        assert actions.dtype == np.float32
        np.testing.assert_array_equal(actions[0], action)


@pytest.mark.parametrize("name", ALONE)
def test_each_of_several_has_its_own_state(env, name):
    observation, _ = env.reset(seed=0)
    policy, both = agents.make(name, env, seed=0), _stacked(observation, observation)
    first, states = policy.predict(both)
    assert first.shape == (2, 8)
    assert (first[0] != first[1]).all() or name in DRAWS_NOTHING
    second, _ = policy.predict(both, states, np.array([False, False]), deterministic=True)
    restarted, _ = policy.predict(both, states, np.array([False, True]), deterministic=True)
    np.testing.assert_array_equal(second[0], restarted[0])
    fresh, _ = agents.make(name, env, seed=0).predict(observation, deterministic=True)
    np.testing.assert_array_equal(restarted[1], fresh)
    for state, start in ((states[:1], None), (states, np.ones(3, bool))):
        with pytest.raises(ValueError, match="episode_start and state must be of 2 environments"):
            policy.predict(both, state, start)


@pytest.mark.parametrize("name", GUIDED)
def test_beliefs_are_those_about_one_environment(env, name):
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match=f"policy '{name}' reads the beliefs about its own environment alone.* 2"):
        agents.make(name, env).predict(_stacked(observation, observation))


@pytest.mark.parametrize("name", READING)
def test_what_no_environment_has_given_is_refused(env, name):
    observation, _ = env.reset(seed=0)
    policy, wrong = agents.make(name, env, seed=0), observation["joint_angles"].copy()
    wrong[3] = np.nan
    for given, said in (
        (None, "must have the entries joint_angles, contacts, got None"),
        ({"contacts": observation["contacts"]}, r"must have the entries .*, got \['contacts'\]"),
        (observation["joint_angles"], "must have the entries"),
        (observation | {"joint_angles": wrong}, "joint_angles of an observation must be finite numbers .* nan"),
        (observation | {"joint_angles": wrong[:5]}, r"joint_angles .* shape \(8,\).*, got shape \(5,\)"),
        (observation | {"joint_angles": ["a"] * 8}, "joint_angles of an observation must be finite numbers"),
        (observation | {"contacts": observation["contacts"] + 2}, "contacts of an observation must be 0 or 1, got"),
        (observation | {"contacts": observation["contacts"][None, None]}, "contacts .* got shape"),
        (_stacked(observation | {"joint_angles": wrong}), "joint_angles .* nan"),
    ):
        with pytest.raises(ValueError, match=said):
            policy.predict(given)
    with pytest.raises(ValueError, match="state must be None or what the last call returned, got 3"):
        policy.predict(observation, 3)


def test_a_vector_that_is_not_finite_is_refused():
    env = BeliefObservation(watched(), ["pose"])
    policy = agents.make("enclosure", env)
    seen, _ = env.reset(seed=0)
    policy.predict(seen)
    for wrong in (np.full_like(seen, np.inf), seen[:3], "pose"):
        with pytest.raises(ValueError, match="an observation must be finite numbers of shape"):
            policy.predict(wrong)
    env.close()


@pytest.mark.parametrize("name", agents.POLICIES)
@pytest.mark.parametrize("seed", [-1, 1.5, "1", np.nan, True, [1]])
def test_a_seed_that_is_none_is_refused(env, name, seed):
    with pytest.raises(ValueError, match="seed must be an integer of at least 0, got"):
        agents.make(name, env, seed=seed)


@pytest.mark.parametrize("name", agents.POLICIES)
@pytest.mark.parametrize("wrong", [None, "HapticSLAM/TwoFinger-v0", "CartPole-v1", "vector"])
def test_what_is_no_environment_with_a_hand_is_refused(name, wrong):
    made = {"CartPole-v1": lambda: gym.make("CartPole-v1"), "vector": lambda: gym.make_vec("CartPole-v1", 2)}
    env = made.get(wrong, lambda: wrong)()
    with pytest.raises(ValueError, match="env must be one environment with a hand, such as HapticSLAM/"):
        agents.make(name, env)


@pytest.mark.parametrize("name", [None, 3, "", "trained ", "Trained", b"trained", ["trained"], "a/b", "\n"])
def test_a_name_that_is_none_lists_the_known(env, name):
    with pytest.raises(ValueError, match=r"unknown policy .* choose from contour_following, .* trained"):
        agents.make(name, env)


@pytest.mark.parametrize("recordings", [3, ["a.npy"], "nothing.npy", "nothing.csv", "."])
def test_recordings_that_are_no_file_are_refused(env, recordings):
    with pytest.raises(ValueError, match=r"recordings must be a \.npy or \.csv file of joint angles, got"):
        agents.make("synergy", env, recordings=recordings)


@pytest.mark.parametrize("kept", [np.zeros((3, 8), complex), np.array([["a"] * 8] * 3), np.array([{}] * 3)])
def test_recordings_that_are_no_angles_are_refused(env, kept, tmp_path):
    np.save(tmp_path / "angles.npy", kept, allow_pickle=True)
    with pytest.raises(ValueError, match=r"recordings must be a \.npy or .*, got|joint_angles must be numbers, got"):
        agents.make("synergy", env, recordings=tmp_path / "angles.npy")


class _Commands:
    """A policy that is not of this project."""

    def __init__(self, action: object) -> None:
        self.action, self.name, self.joints = action, "foreign", 8

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return self.action, state


@pytest.mark.parametrize(
    ("action", "said"),
    [
        (np.zeros(7, np.float32), r"policy 'foreign' commands torques of shape \(7,\); the hand has 8 joints"),
        (np.float32(0.0), r"torques of shape \(\); the hand has 8"),
        (None, "policy 'foreign' commands no torques, but None"),
        (["a"] * 8, "policy 'foreign' commands no torques, but"),
        (np.full(8, np.inf), "policy 'foreign' commands torques that are not finite"),
    ],
)
def test_acting_refuses_what_no_motor_can_do(action, said):
    with pytest.raises(ValueError, match=said):
        agents.act(_Commands(action), {})


@pytest.mark.parametrize("policy", [None, "random_torque", agents])
def test_acting_refuses_what_is_no_policy(policy):
    with pytest.raises(ValueError, match="policy must have `predict`, as those of"):
        agents.act(policy, {})


STATES = [(), (None,), ("x",), (np.zeros(3),) * 9, [np.zeros(8)], 3, {}]


@pytest.mark.parametrize("state", STATES, ids=map(str, range(len(STATES))))
@pytest.mark.parametrize("name", agents.POLICIES)
def test_a_state_that_no_call_has_returned_is_refused(env, name, state):
    observation, _ = env.reset(seed=0)
    policy = agents.make(name, env, seed=0)
    with pytest.raises(ValueError, match="state must be"):
        policy.predict(observation, state)


@pytest.mark.parametrize("name", agents.POLICIES)
def test_a_state_that_is_not_finite_is_refused(env, name):
    observation, _ = env.reset(seed=0)
    policy = agents.make(name, env, seed=0)
    _, state = policy.predict(observation)
    spoilt = tuple(None if each is None else np.full(np.shape(each), np.nan) for each in state)
    with pytest.raises(ValueError, match=r"entry \d of state must be finite numbers"):
        policy.predict(observation, spoilt)
    policy.predict(observation, state)


@pytest.mark.parametrize("deterministic", [1, "yes", None])
def test_deterministic_is_a_switch(env, deterministic):
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match="deterministic must be True or False"):
        agents.make("random_torque", env).predict(observation, deterministic=deterministic)


@pytest.mark.parametrize("torques", [np.full((2, 8), np.nan), np.full((2, 8), 2.0), np.zeros((2, 7)), np.zeros(8), "a"])
def test_torques_that_no_motor_has_are_not_repeated(env, torques):
    with pytest.raises(ValueError, match="torques must"):
        RepeatTorques(env, torques)


@pytest.mark.parametrize("start", [2, "yes", [np.nan], np.zeros(1, "f4,f4")], ids=map(str, range(4)))
@pytest.mark.parametrize("name", agents.POLICIES)
def test_an_episode_starts_or_not(env, name, start):
    observation, _ = env.reset(seed=0)
    policy = agents.make(name, env, seed=0)
    for seen in (observation, _stacked(observation)):
        with pytest.raises(ValueError, match="episode_start must be 0 or 1"):
            policy.predict(seen, None, start)


@pytest.mark.parametrize("name", agents.POLICIES)
def test_more_environments_than_run_anywhere_are_refused_before_anything_is_made(env, name):
    observation, _ = env.reset(seed=0)
    many = {key: np.broadcast_to(each, (10**9, *each.shape)) for key, each in observation.items()}
    with pytest.raises(ValueError, match="must be of 65536 environments at most, got 1000000000"):
        agents.make(name, env, seed=0).predict(many)
