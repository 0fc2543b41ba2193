"""The observer beside an environment."""

from __future__ import annotations

import multiprocessing
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import haptic_env
from haptic_env import hands, shapes
from haptic_env.recordings import ObserverInputs, Recording
from haptic_env.replay import Playback
from observer import OBSERVERS, Belief, HapticSLAM, ObserverWrapper, PoseOnly, ShapePosterior
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


LIKE_SPAWN = ("forkserver",)  # of which processes are told and know as much as spawned ones


@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")  # of Python 3.12
@pytest.mark.parametrize(
    ("mode", "keywords"),
    [
        ("sync", None),
        *(
            pytest.param(
                "async", {"context": context}, marks=[pytest.mark.statistical] if context in LIKE_SPAWN else []
            )
            for context in multiprocessing.get_all_start_methods()
        ),
    ],
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


def test_a_namer_of_another_hand_is_refused():
    inner = gym.make("HapticSLAM/TwoFinger-v0")
    hand = inner.unwrapped.hand
    for other in (hands.make("two_finger", patches_around=6), pointer()):
        solids = {"cube": [shapes.make("cube", position=hand.grasp_centre)]}
        with pytest.raises(ValueError, match=rf"the shape knows hand '{other.name}' with {len(other.patches)} patches"):
            ObserverWrapper(inner, PoseOnly(hand), ShapePosterior(other, solids))
    inner.close()


@pytest.mark.parametrize("make", [HapticSLAM, PoseOnly, HapticSLAM.paper, *(OBSERVERS[n] for n in ("floor", "kalman"))])
@pytest.mark.parametrize("rate", [100.0, 25.0])
def test_another_control_rate_is_refused_with_both(make, rate):
    inner = gym.make("HapticSLAM/TwoFinger-v0", control_hz=rate)
    hand = inner.unwrapped.hand
    with pytest.raises(ValueError, match=rf"control_hz=50, the environment has control_hz={rate:g};"):
        ObserverWrapper(inner, make(hand))
    ObserverWrapper(inner, make(hand, control_hz=rate))
    inner.close()


def test_observations_without_what_is_felt_are_refused():
    inner = gym.make("HapticSLAM/TwoFinger-v0")
    with pytest.raises(ValueError, match=r"hears joint_angles and contacts, got a space Box; put the Observer"):
        ObserverWrapper(gym.wrappers.FlattenObservation(inner), PoseOnly(inner.unwrapped.hand))
    inner.close()


CHANGES = {
    "nothing": lambda env: env,
    "rescaled": lambda env: gym.wrappers.RescaleAction(env, np.float32(-10), np.float32(10)),
    "clipped": gym.wrappers.ClipAction,
    "sticky": lambda env: gym.wrappers.StickyAction(env, 0.5),
    "turned round": lambda env: gym.wrappers.TransformAction(env, np.negative, env.action_space),
}


@pytest.mark.parametrize("name", CHANGES)
def test_the_observer_hears_the_torque_that_was_commanded(name, bits):
    """Whatever wrappers between it and the hand make of an action."""
    inner = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=1.0)
    env = ObserverWrapper(CHANGES[name](inner), HapticSLAM(inner.unwrapped.hand, particles=2, lag=0))
    alone = HapticSLAM(inner.unwrapped.hand, particles=2, lag=0)
    env.reset(seed=1)
    alone.reset(seed=int(np.random.SeedSequence(1).generate_state(1)[0]))
    env.action_space.seed(0)
    differs = False
    for _ in range(10):
        action = env.action_space.sample().clip(-10, 10)
        seen, *_, info = env.step(action)
        torque = inner.unwrapped.commanded
        differs |= not np.array_equal(torque, action)
        belief = alone.step(torque, seen["joint_angles"], seen["contacts"])
        assert bits(belief) == bits(info["belief"])
    assert differs == (name != "nothing")
    env.close()


def test_the_torque_that_was_commanded_has_no_motor_noise():
    env = gym.make("HapticSLAM/TwoFinger-v0", motor_noise=1.0).unwrapped
    env.reset(seed=0)
    assert not env.commanded.any()
    action = np.float32([0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7, -0.8])
    env.step(action)
    np.testing.assert_array_equal(env.commanded, action)
    assert np.abs(env._data.ctrl - action).max() > 0.01
    env.commanded[:] = 7.0
    np.testing.assert_array_equal(env.commanded, action)
    env.reset()
    assert not env.commanded.any()


def test_a_playback_tells_the_torque_of_the_recording(two_finger):
    torques = np.random.default_rng(0).uniform(-1, 1, (5, 8))
    rest = np.tile(two_finger.rest_pose, (5, 1))
    felt = ObserverInputs(torques, rest, np.zeros((5, 50), bool))
    recording = Recording("it", 0.02 * np.arange(5), two_finger.joint_names[::-1], rest[:, ::-1], felt=felt)
    env = Playback(two_finger, recording, shapes.make("cube"))
    env.reset(seed=0)
    for step in range(1, 5):
        env.step(np.zeros(8))
        np.testing.assert_array_equal(env.commanded, torques[step, ::-1])


class Twice(gym.Wrapper):
    """Takes two steps at once."""

    def step(self, action):
        self.env.step(action)
        return self.env.step(action)


@pytest.mark.parametrize("wrap", [Twice, gym.wrappers.Autoreset])
def test_steps_that_the_observer_does_not_hear_of_are_refused(wrap):
    inner = gym.make("HapticSLAM/TwoFinger-v0", episode_seconds=0.06)
    env = ObserverWrapper(wrap(inner), PoseOnly(inner.unwrapped.hand))
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"went from control step \d to \d at once"):  # noqa: PT012 - the fourth, of Autoreset
        for _ in range(4):
            if not env.step(np.zeros(8))[3]:
                continue
            env.observer.reset()
    env.close()


def _watched_by(observer, shape=None) -> ObserverWrapper:
    return ObserverWrapper(gym.make("HapticSLAM/TwoFinger-v0", episode_seconds=0.1), observer, shape)


@pytest.mark.parametrize("shared", ["HapticSLAM", "PoseOnly", "ShapePosterior"])
def test_one_observer_in_two_environments_is_refused(two_finger, shared):
    made = {"HapticSLAM": lambda: HapticSLAM(two_finger, particles=2), "PoseOnly": lambda: PoseOnly(two_finger)}
    if shared == "ShapePosterior":
        shape = ShapePosterior(two_finger)
        first, second = (_watched_by(PoseOnly(two_finger), shape) for _ in range(2))
    else:
        observer = made[shared]()
        first, second = (_watched_by(observer) for _ in range(2))
    first.reset(seed=0)
    first.step(np.zeros(8))
    second.reset(seed=0)
    second.step(np.zeros(8))
    with pytest.raises(ValueError, match=f"this {shared} has begun a trial in another environment .* one of its own"):
        first.step(np.zeros(8))
    second.step(np.zeros(8))
    first.close()
    second.close()


@pytest.mark.parametrize("closed", [True, False])
def test_an_observer_may_watch_one_environment_after_the_other(two_finger, closed):
    """Whether or not the first one was closed, or its episode ended."""
    observer, shape = HapticSLAM(two_finger, particles=2), ShapePosterior(two_finger)
    for steps in (5, 2, 5):
        env = _watched_by(observer, shape)
        env.reset(seed=0)
        for _ in range(steps):
            env.step(np.zeros(8))
        if closed:
            env.close()
    again = ObserverWrapper(env.env, observer, shape)  # about the same environment
    again.reset(seed=0)
    again.step(np.zeros(8))
    env.reset(seed=0)
    env.step(np.zeros(8))
    env.close()


@pytest.mark.parametrize("given", [None, "haptic_slam", HapticSLAM, 3, np.zeros(3)], ids=str)
def test_what_is_no_observer_or_namer_is_refused(two_finger, given):
    inner = gym.make("HapticSLAM/TwoFinger-v0")
    if given is not HapticSLAM:
        with pytest.raises(ValueError, match="observer must be a HapticSLAM, a PoseOnly or the like, got"):
            ObserverWrapper(inner, given)
    if given is not None:
        with pytest.raises(ValueError, match="shape must be a ShapePosterior, or None, got"):
            ObserverWrapper(inner, PoseOnly(two_finger), given)
    inner.close()


def test_an_environment_without_a_hand_is_refused(two_finger):
    other = gym.make("CartPole-v1")
    with pytest.raises(ValueError, match=r"env must be one environment with a hand, .*CartPole"):
        ObserverWrapper(other, PoseOnly(two_finger))
    other.close()
