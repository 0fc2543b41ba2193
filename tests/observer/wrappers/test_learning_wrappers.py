"""What turns a belief into a learner's observation, reward and end."""

from __future__ import annotations

import dataclasses
import warnings
from types import SimpleNamespace

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import agents
import haptic_env
from agents.hold_action import HoldAction
from haptic_env import shapes
from haptic_env.grid import Grid
from observer import (
    BeliefFeatures,
    BeliefObservation,
    DecideWhenSure,
    DecisionReward,
    HapticSLAM,
    InformationGainReward,
    ObserverWrapper,
    PoseOnly,
    ShapePosterior,
)
from observer.belief import Belief
from observer.wrappers.belief_observation import ENTRIES, USUAL
from tests.observer.hands import pointer

WRAPPERS = {
    "BeliefObservation": BeliefObservation,
    "InformationGainReward of the name": InformationGainReward,
    "InformationGainReward of the map": lambda env: InformationGainReward(env, "map"),
    "DecisionReward": DecisionReward,
    "DecideWhenSure": DecideWhenSure,
    "HoldAction": HoldAction,
    "all": lambda env: HoldAction(BeliefObservation(DecisionReward(DecideWhenSure(env))), 3),
}


def watched(env: gym.Env) -> ObserverWrapper:
    """`env` with an observer of its hand that names the object."""
    hand = env.unwrapped.hand
    return ObserverWrapper(env, HapticSLAM(hand, particles=2, lag=3), ShapePosterior(hand, samples=8))


@pytest.fixture(params=list(haptic_env.ENVIRONMENTS))
def env(request: pytest.FixtureRequest):
    """Every registered environment, short, watched."""
    made = watched(gym.make(request.param, shape="cube", episode_seconds=0.5, reveal_truth=True))
    yield made
    made.close()


@pytest.fixture
def two_fingers():
    """The two-finger hand about a cube, half a second long, watched."""
    made = watched(gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=0.5, reveal_truth=True))
    yield made
    made.close()


def close_hand(env: gym.Env) -> np.ndarray:
    """Torques that close the fingers."""
    return np.ones(env.action_space.shape, np.float32)


def check(env: gym.Env, name: str) -> None:
    """Both checkers, of Gymnasium and of Stable-Baselines3, let wrapper `name` pass without a warning."""
    sb3 = pytest.importorskip("stable_baselines3.common.env_checker")
    wrapped = WRAPPERS[name](env)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*is different from the unwrapped version.*")
        check_env(wrapped, skip_render_check=True, skip_close_check=True)  # which makes a second one
        sb3.check_env(wrapped, skip_render_check=True)


@pytest.mark.parametrize("name", WRAPPERS)
def test_both_checkers_pass_without_a_warning(two_fingers, name):
    check(two_fingers, name)


def test_both_checkers_pass_all_wrappers_of_any_hand(env):
    check(env, "all")


@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")  # of Python 3.12
@pytest.mark.parametrize("mode", ["sync", "async"])
def test_vectors_of_wrapped_environments(mode):
    envs = gym.make_vec(
        "haptic_env:HapticSLAM/TwoFinger-v0",
        num_envs=2,
        vectorization_mode=mode,
        wrappers=[watched, WRAPPERS["all"], gym.wrappers.RecordEpisodeStatistics],
        episode_seconds=0.2,
        reveal_truth=True,
    )
    try:
        observation, _ = envs.reset(seed=[1, 2])
        ends = 0
        for _ in range(6):  # past the end of an episode
            observation, reward, _, truncated, info = envs.step(envs.action_space.sample())
            assert reward.shape == (2,)
            ends += int(truncated.any() and "episode" in info)
        assert ends, "the statistics are told"
        assert observation in envs.observation_space
    finally:
        envs.close()


def test_normalised_vectors_of_stable_baselines3():
    vec_env = pytest.importorskip("stable_baselines3.common.vec_env")

    def make() -> gym.Env:
        env = gym.make("HapticSLAM/TwoFinger-v0", episode_seconds=0.2, reveal_truth=True)
        return gym.wrappers.RecordEpisodeStatistics(WRAPPERS["all"](watched(env)))

    envs = vec_env.VecNormalize(vec_env.DummyVecEnv([make, make]))
    envs.reset()
    for _ in range(6):
        observation, reward, done, infos = envs.step([envs.action_space.sample() for _ in range(2)])
        assert np.isfinite(observation).all()
        assert np.isfinite(reward).all()
        assert all("episode" in info for info, ended in zip(infos, done, strict=True) if ended)
    envs.close()


def test_the_entries_are_what_they_say(two_fingers):
    env = BeliefObservation(two_fingers)
    hand, features = env.unwrapped.hand, env.features
    observation, info = env.reset(seed=0)
    for _ in range(20):
        observation, *_, info = env.step(close_hand(env))
    sizes = {"pose": 8, "spread": 8, "motion": 8, "contacts": 50, "names": 4, "occupancy": 54, "time": 1, "rhythm": 6}
    assert tuple(sizes) == USUAL == features.entries == env.observation_space.entries
    assert set(ENTRIES) == {*USUAL, "covered"}
    parts = dict(zip(sizes, np.split(observation, np.cumsum(list(sizes.values()))[:-1]), strict=True))
    belief = info["belief"]
    low, high = hand.joint_limits.T
    np.testing.assert_allclose(low + (parts["pose"] + 1) / 2 * (high - low), belief.joint_angles, atol=1e-6)
    np.testing.assert_allclose(parts["spread"], belief.joint_std / 0.1, rtol=1e-5)
    np.testing.assert_allclose(parts["motion"], belief.joint_angles - belief.lagged_joint_angles, atol=1e-6)
    assert set(parts["contacts"]) == {0.0, 1.0}
    np.testing.assert_allclose(parts["names"], info["posterior"], rtol=1e-5)
    assert parts["time"] == pytest.approx(0.2)
    turns = 0.4 * np.pi, 0.8 * np.pi, 0.136 * np.pi
    expected = [wave(turn) for turn in turns for wave in (np.sin, np.cos)]
    np.testing.assert_allclose(parts["rhythm"], expected, rtol=1e-5)
    assert parts["occupancy"].min() < -0.9, "where the fingers have been is air"
    assert features.space == env.observation_space


def as_if(belief: Belief, probability: np.ndarray) -> Belief:
    """The same belief with another map."""
    return dataclasses.replace(belief, snapshot=SimpleNamespace(value=lambda: probability))


def test_covered_counts_the_occupied_voxels_of_each_part_of_the_map(two_fingers):
    features = BeliefObservation(two_fingers, ["covered"]).features
    _, info = two_fingers.reset(seed=0)
    probability = np.random.default_rng(0).random((32, 32, 32)) ** 4
    observation = features.vector(as_if(info["belief"], probability), np.zeros(50), info["posterior"], 0)
    ends = [int(np.ceil(32 * part / 5)) for part in range(6)]
    parts = [slice(*ends[part : part + 2]) for part in range(5)]
    expected = [(probability[x, y, z] > 0.5).sum() / 6.4**2 for x in parts for y in parts for z in parts]
    np.testing.assert_allclose(observation, np.clip(expected, 0.0, 2.0), rtol=1e-6)
    assert max(expected) > 1.0


def test_the_surface_pays_for_occupied_voxels_alone(two_fingers):
    env = InformationGainReward(two_fingers, "surface")
    _, info = two_fingers.reset(seed=0)
    map = np.full((32, 32, 32), 0.5)
    map[:10] = 0.001  # found to be empty
    assert env.potential({"belief": as_if(info["belief"], map)}) == 0.0
    map[20, 20, 20], map[21, 20, 20] = 1.0, 0.9
    worth = 1.0 + 1.0 + 0.9 * np.log2(0.9) + 0.1 * np.log2(0.1)
    assert env.potential({"belief": as_if(info["belief"], map)}) == pytest.approx(worth)


def test_occupancy_is_that_of_the_cells_about_the_fingertips(two_fingers):
    env = BeliefObservation(two_fingers, ["occupancy"])
    env.reset(seed=0)
    for _ in range(20):
        observation, *_, info = env.step(close_hand(env))
    belief, hand = info["belief"], env.unwrapped.hand
    data = mujoco.MjData(hand.model)
    data.qpos[:] = belief.joint_angles
    mujoco.mj_kinematics(hand.model, data)
    for finger, link in enumerate(link for link in hand.links if link.tip):
        body = data.body(link.body)
        for number, (i, j, k) in enumerate(np.ndindex(3, 3, 3)):
            place = np.array([i - 1, j - 1, k - 1]) * 0.01 + [0, 0, link.length]
            voxel = (body.xpos + body.xmat.reshape(3, 3) @ place - belief.grid.origin) // belief.grid.resolution
            expected = 2 * belief.occupancy[tuple(voxel.astype(int))] - 1
            assert observation[27 * finger + number] == pytest.approx(expected)


def test_beyond_the_map_nothing_is_known(two_finger):
    features = BeliefFeatures(two_finger, ("cube",), 10.0, 50.0, ["occupancy"])
    belief = HapticSLAM(two_finger, particles=1, grid=Grid((1.0, 1.0, 1.0), 0.004, (8, 8, 8))).reset(seed=0)
    assert (features.vector(belief, np.zeros(50), np.ones(1), 0) == 0.0).all()


def test_entries_are_chosen_and_checked(two_fingers):
    env = BeliefObservation(two_fingers, ["time", "names"])
    observation, info = env.reset(seed=0)
    np.testing.assert_allclose(observation, [1.0, *info["posterior"]])
    with pytest.raises(ValueError, match=r"unknown entry 'poses' \(did you mean 'pose'\?\); choose from contacts"):
        BeliefObservation(two_fingers, ["poses"])
    with pytest.raises(ValueError, match="entries must name at least one of pose"):
        BeliefObservation(two_fingers, [])


@pytest.mark.parametrize("name", ["BeliefObservation", "InformationGainReward of the name", "DecideWhenSure"])
def test_who_asks_for_names_says_what_is_missing(name):
    bare = gym.make("HapticSLAM/TwoFinger-v0", reveal_truth=True)
    for env in (bare, ObserverWrapper(bare, HapticSLAM(bare.unwrapped.hand, particles=2))):
        with pytest.raises(ValueError, match=r"nothing names the object.*ObserverWrapper\(env, HapticSLAM"):
            WRAPPERS[name](env)


def test_gains_add_up_to_what_is_known(two_fingers):
    """Whatever the path: the sum of rewards is the difference of the potentials at its ends."""
    for wrap, potential in (
        (lambda env: DecisionReward(env, price=0.0), lambda info: np.log(info["posterior"][0])),
        (
            InformationGainReward,
            lambda info: np.sum(info["posterior"] * np.log2(np.maximum(info["posterior"], 1e-300))),
        ),
    ):
        env = wrap(two_fingers)
        _, info = env.reset(seed=1)
        first, total = potential(info), 0.0
        for _ in range(25):
            _, reward, _, _, info = env.step(close_hand(env))
            total += reward
        assert total == pytest.approx(potential(info) - first)
        assert abs(total) > 0.01, "something was learnt"


def test_information_of_the_map_is_that_of_its_voxels(two_fingers):
    env = InformationGainReward(two_fingers, "map")
    env.reset(seed=1)
    total = sum(env.step(close_hand(env))[1] for _ in range(25))
    p = two_fingers.belief.occupancy
    entropy = -(p * np.log2(p) + (1 - p) * np.log2(1 - p)).sum()
    assert total == pytest.approx(p.size - entropy)
    with pytest.raises(ValueError, match=r"unknown objective 'maps'.*choose from class, map"):
        InformationGainReward(two_fingers, "maps")


def test_time_has_its_price(two_fingers):
    rewards = []
    for price in (0.0, 2.0):
        env = DecisionReward(two_fingers, price=price)
        env.reset(seed=1)
        rewards.append(env.step(close_hand(env))[1])
    assert rewards[0] - rewards[1] == pytest.approx(2.0 * 0.02)


def test_the_decisions_reward_is_told_the_truth_and_says_at_the_end_whether_it_was_found(two_fingers):
    env = DecisionReward(two_fingers)
    env.reset(seed=1)
    for step in range(25):
        *_, info = env.step(close_hand(env))
        assert ("is_success" in info) == (step == 24)
    assert info["is_success"] == (info["posterior"].argmax() == 0)
    hidden = watched(gym.make("HapticSLAM/TwoFinger-v0"))
    with pytest.raises(ValueError, match="reveal_truth=True"):
        DecisionReward(hidden)
    other = gym.make("HapticSLAM/TwoFinger-v0", shape="sphere", reveal_truth=True)
    hand = other.unwrapped.hand
    alone = ShapePosterior(hand, {"cube": [shapes.make("cube")]}, samples=8)
    with pytest.raises(ValueError, match="unknown label of the true shape 'sphere'; choose from cube"):
        DecisionReward(ObserverWrapper(other, HapticSLAM(hand, particles=2), alone)).reset(seed=0)


def test_an_episode_ends_where_one_is_sure(two_fingers):
    env = DecideWhenSure(two_fingers, threshold=0.3, seconds=0.1)
    env.reset(seed=1)
    sure = []
    for _ in range(25):
        _, _, terminated, _, info = env.step(close_hand(env))
        sure.append(info["posterior"].max() > 0.3)
        assert terminated == (len(sure) >= 5 and all(sure[-5:])), "for a tenth of a second, five steps"
        assert ("decision" in info) == terminated
        if terminated:
            break
    assert terminated
    assert info["decision"] == two_fingers.shape.labels[int(info["posterior"].argmax())]
    env.reset(seed=1)
    assert not env.step(close_hand(env))[2], "a new episode begins anew"


def test_an_action_is_held(two_fingers):
    env = HoldAction(DecisionReward(two_fingers), 10)
    env.reset(seed=1)
    ends, total = [], 0.0
    for _ in range(3):
        _, reward, _, truncated, info = env.step(close_hand(env))
        total += reward
        ends.append(truncated)
    assert ends == [False, False, True], "the last one is cut short by the end"
    assert total == pytest.approx(np.log(info["posterior"][0] / 0.25) - 0.25 * 0.5)
    with pytest.raises(ValueError, match="steps must be an integer of at least 1, got 0"):
        HoldAction(two_fingers, 0)


def test_no_learner_sees_the_truth():
    """Only `DecisionReward` may: all else is the same bits where the truth is corrupted."""

    class Corrupt(gym.Wrapper):
        def reset(self, **keywords):
            return super().reset(**keywords)[0], {"truth": None}

        def step(self, action):
            return *super().step(action)[:-1], {"truth": None}

    runs = []
    for corrupt in (lambda env: env, Corrupt):
        inner = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=0.5, reveal_truth=True)
        env = BeliefObservation(InformationGainReward(DecideWhenSure(watched(corrupt(inner)))))
        policy, state = agents.make("random_torque", env, seed=0), None
        observation, _ = env.reset(seed=0)
        told = [observation.tobytes()]
        for _ in range(25):
            action, state = policy.predict(observation, state)
            observation, reward, *_ = env.step(action)
            told += [observation.tobytes(), reward]
        runs.append(told)
        inner.close()
    assert runs[0] == runs[1]


def test_a_hand_without_fingertips_has_no_occupancy_about_them():
    hand = pointer()
    tips = sum(link.tip for link in hand.links)
    features = BeliefFeatures(hand, ("a", "b"), 1.0, 50.0, ["occupancy", "time"])
    assert features.space.shape == (27 * tips + 1,)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"contacts": np.full(50, np.nan)}, "contacts must be 0 or 1, got nan"),
        ({"contacts": np.zeros(49)}, r"contacts must be 0 or 1 of shape \(50,\)"),
        ({"contacts": np.zeros(50, complex)}, "contacts must be 0 or 1"),
        ({"posterior": [np.nan, 0.5]}, "posterior must be finite .*nan"),
        ({"posterior": [0.5, 1e300]}, r"posterior must lie in \[-1, 1\]"),
        ({"posterior": [1.0]}, r"posterior must be .*got shape \(1,\)"),
        ({"step": np.nan}, "step must be an integer"),
        ({"step": -1}, "step must be an integer"),
        ({"step": 10**30}, "step must be an integer"),
    ],
)
def test_features_of_what_is_not_felt_are_refused(two_finger, changed, told):
    features = BeliefFeatures(two_finger, ("cube", "ball"), 10.0, 50.0, ["contacts", "names", "time"])
    given = {"contacts": np.zeros(50), "posterior": [0.5, 0.5], "step": 3}
    belief = PoseOnly(two_finger).reset()
    assert np.isfinite(features.vector(belief, **given)).all()
    with pytest.raises(ValueError, match=told):
        features.vector(belief, **{**given, **changed})


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"hand": "two_finger"}, "hand must be a haptic_env"),
        ({"labels": "cube"}, "labels must be a list of names, got 'cube'"),
        ({"labels": None}, "labels must be a list of names, got None"),
        ({"seconds": np.nan}, "seconds must be a finite number in"),
        ({"seconds": 0}, "seconds must be a finite number in"),
        ({"control_hz": None}, "control_hz must be a finite number"),
        ({"control_hz": 1e-320}, "control_hz must be a finite number"),
        ({"entries": "pose"}, "entries must be a list of some of pose, .* got 'pose'"),
        ({"entries": 3}, "entries must be a list of some of pose, .* got 3"),
    ],
)
def test_features_of_nothing_are_refused(two_finger, changed, told):
    given = {"hand": two_finger, "labels": ("cube",), "seconds": 10.0, "control_hz": 50.0, "entries": None}
    with pytest.raises(ValueError, match=told):
        BeliefFeatures(**{**given, **changed})
