"""Environments side by side give what each of them gives alone, bit for bit."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv

from haptic_lab.learning.batched import ThreadedVectorEnv
from haptic_lab.learning.batched_learners import ThreadedVecEnv
from haptic_lab.learning.environments import make_env
from haptic_lab.learning.presets import TrainingWorld

ENTRIES = ("pose", "spread", "motion", "contacts", "names", "time", "rhythm")
COUNT, STEPS = 3, 30
WORLDS = {
    "belief": TrainingWorld(observation=ENTRIES, hold=2, seconds=0.8, variants=24, stride=3, temper=0.07),
    "what is felt": TrainingWorld(observation=("raw",), hold=1, seconds=0.4, variants=4),
    "worse senses": TrainingWorld(
        observation=ENTRIES, hold=2, seconds=0.8, variants=8, bias_deg=3.0, contact_miss=0.1, patches_dead=0.1
    ),
    "a map": TrainingWorld(observation=("names", "occupancy"), hold=3, seconds=0.6, variants=8),
}


def actions(count: int = COUNT) -> np.ndarray:
    """(STEPS, E, J): a hand that closes, shaken."""
    return np.tanh(0.6 + np.random.default_rng(7).standard_normal((STEPS, count, 8))).astype(np.float32)


def same(one, other):
    """Whether both are the same, bit for bit, but for the time that episodes took."""
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one.keys() - {"t", "_t"}:
            same(one[key], other[key])
    elif isinstance(one, list | tuple) or (isinstance(one, np.ndarray) and one.dtype.kind == "O"):
        for a, b in zip(one, other, strict=True):
            same(a, b)
    else:
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("world", "mode"),
    [*((world, AutoresetMode.NEXT_STEP) for world in WORLDS), ("belief", AutoresetMode.SAME_STEP)],
)
def test_a_vector_of_gymnasium_is_the_same_bits(world, mode):
    makers = [partial(make_env, WORLDS[world])] * COUNT
    alone = SyncVectorEnv(makers, autoreset_mode=mode)
    together = ThreadedVectorEnv(makers, threads=2, autoreset_mode=mode)
    assert together.metadata["autoreset_mode"] is mode
    assert together.observation_space == alone.observation_space
    for seed in (900_000, [900_007, 900_003, 900_005], None)[: 3 if world == "belief" else 1]:
        same(together.reset(seed=seed), alone.reset(seed=seed))
        ends = 0
        for action in actions():
            told = together.step(action)
            same(told, alone.step(action))
            ends += told[3].sum() + told[2].sum()
        assert ends >= COUNT, "episodes end, and others begin"
    together.close()
    alone.close()


@pytest.mark.parametrize("world", ["belief", "what is felt"])
def test_a_vector_of_stable_baselines_is_the_same_bits(world):
    makers = [partial(make_env, WORLDS[world])] * COUNT
    alone, together = DummyVecEnv(makers), ThreadedVecEnv(makers, threads=2)
    for env in (alone, together):
        env.seed(900_000)
    same(together.reset(), alone.reset())
    ends = []
    for action in actions():
        told = together.step(action)
        same(told, alone.step(action))
        ends += [info["terminal_observation"] for info in told[3] if "terminal_observation" in info]
    assert len(ends) >= COUNT
    together.close()
    alone.close()


@pytest.mark.parametrize("world", ["belief", "worse senses"])
def test_steps_that_nobody_looks_at_are_the_same_steps(world):
    held, single = (make_env(replace(WORLDS[world], hold=hold, seconds=1.0)) for hold in (3, 1))
    held.reset(seed=900_001)
    single.reset(seed=900_001)
    over, decisions = False, 0
    while not over:
        action = actions(1)[decisions, 0]
        observation, reward, terminated, truncated, _ = held.step(action)
        rewards = []
        for _ in range(3):
            seen, gain, ended, cut, _ = single.step(action)
            rewards.append(gain)
            if ended or cut:
                break
        np.testing.assert_array_equal(seen, observation)
        assert (sum(rewards), ended, cut) == (reward, terminated, truncated)
        over, decisions = terminated or truncated, decisions + 1
    assert decisions > 3


def test_options_of_a_reset_reach_every_environment():
    env = ThreadedVectorEnv([partial(make_env, WORLDS["belief"])] * COUNT, threads=2)
    env.reset(seed=900_000, options={"shape": "sphere"})
    assert {each.solid.name for each in env.get_attr("unwrapped")} == {"sphere"}
    env.close()


def test_a_learner_learns_in_it():
    env = ThreadedVecEnv([partial(make_env, WORLDS["belief"])] * 4, threads=2)
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=64, n_epochs=1, seed=0, device="cpu")
    assert model.learn(256).num_timesteps == 256
    env.close()


class Broken(gym.Wrapper):
    """Fails at its second step."""

    def step(self, action):
        raise ValueError("the motor is off")


def test_what_goes_wrong_in_one_is_told():
    makers = [partial(gym.make, "HapticSLAM/TwoFinger-v0"), lambda: Broken(gym.make("HapticSLAM/TwoFinger-v0"))]
    env = ThreadedVectorEnv(makers, threads=2)
    env.reset(seed=900_000)
    with pytest.raises(ValueError, match="the motor is off"):
        env.step(np.zeros(env.action_space.shape, np.float32))
    env.close()


class Fragile(gym.Wrapper):
    """Fails at the actions that are told to."""

    fails = False

    def step(self, action):
        if self.fails:
            raise ValueError("the motor is off")
        return self.env.step(action)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_after_one_has_failed_a_seed_is_what_it_was(mode, threads):
    short = replace(WORLDS["what is felt"], seconds=0.06)
    makers = [partial(make_env, short), lambda: Fragile(make_env(WORLDS["what is felt"]))]
    env = ThreadedVectorEnv(makers, threads=threads, autoreset_mode=mode)

    def first_steps():
        return [env.reset(seed=900_000)[0], *(env.step(action)[0] for action in actions(2)[:2])]

    usual = first_steps()
    env.step(actions(2)[2])  # the first episode of the one that does not fail is over
    env.envs[1].env.fails = True
    with pytest.raises(ValueError, match="the motor is off"):
        env.step(actions(2)[3])
    env.envs[1].env.fails = False
    same(first_steps(), usual)
    env.close()


@pytest.mark.parametrize(
    "given", [None, np.zeros(8), np.zeros((1, 8)), np.zeros((2, 7)), np.zeros((3, 8)), "stop"], ids=str
)
def test_actions_are_a_row_for_each(given):
    env = ThreadedVectorEnv([partial(gym.make, "HapticSLAM/TwoFinger-v0")] * 2, threads=1)
    env.reset(seed=900_000)
    with pytest.raises(ValueError, match=r"actions must be of shape \(2, 8\), a row for each environment, got "):
        env.step(given)
    env.close()


@pytest.mark.parametrize("count", [0, 1, 3])
def test_stable_baselines_too_is_told_that_actions_are_too_few_or_too_many(count):
    env = ThreadedVecEnv([partial(gym.make, "HapticSLAM/TwoFinger-v0")] * 2, threads=1)
    env.reset()
    with pytest.raises(ValueError, match=f"actions must be 2, one for each environment, got {count}"):
        env.step(np.zeros((count, 8), np.float32))
    env.close()


@pytest.mark.parametrize("threads", [1, 2])
def test_what_is_closed_takes_no_step(threads):
    env = ThreadedVectorEnv([partial(gym.make, "HapticSLAM/TwoFinger-v0")] * 2, threads=threads)
    env.reset(seed=900_000)
    env.close()
    env.close()
    with pytest.raises(RuntimeError, match="are closed"):
        env.step(np.zeros(env.action_space.shape, np.float32))


@pytest.mark.parametrize("threads", [0, 1.5, "two", True])
def test_threads_are_a_number(threads):
    with pytest.raises(ValueError, match="threads must be"):
        ThreadedVectorEnv([partial(gym.make, "HapticSLAM/TwoFinger-v0")] * 2, threads=threads)
