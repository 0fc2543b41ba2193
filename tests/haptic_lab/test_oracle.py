"""The oracle of long tests: what it simulates is what the hand then does, and it touches more than chance."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import agents
from haptic_env import hand_env
from haptic_lab.learning.covering import Touched
from haptic_lab.tasks.registry import world_of
from haptic_lab.tasks.worlds import as_drawn
from tests.haptic_lab.oracle import Oracle

SEED, STEPS, HOLD = 920_003, 50, 2


class Quick(Oracle):
    candidates, dreams = 10, 5.0


def world() -> Any:
    """One whose motors have no noise."""
    return as_drawn(replace(world_of("Map"), motor_noise=0.0))


def test_who_knows_the_truth_touches_more_than_chance() -> None:
    """In a second."""
    env, share = world(), {}
    touched = Touched(hand_env(env).hand)
    for policy in (agents.make("random_torque", env, 0), Quick(env, 0)):
        observation, info = env.reset(seed=SEED)
        touched.reset()
        state = None
        for step in range(STEPS):
            torque, state = agents.act(policy, observation, state)
            observation, *_, info = env.step(torque)
            if step % HOLD:
                touched.take(info["truth"]["joint_angles"], observation["contacts"] == 1, env.unwrapped.solid)
        share[type(policy).__name__] = touched.share(env.unwrapped.solid)
    assert share["Quick"] > 1.5 * share["RandomTorque"] + 0.01, share


def test_what_is_simulated_happens_and_fingers_follow_candidates_of_their_own() -> None:
    """About an object that both of them touch."""
    env = world()
    env.reset(seed=SEED)
    oracle = Quick(env, 0)
    torque, state = oracle.decide(None, None, True)
    for _ in range(100):
        if oracle._felt(oracle._env._data).any(axis=1).all():
            break
        env.step(torque)
        torque, state = oracle.decide(None, state, True)
    assert oracle._felt(oracle._env._data).any(axis=1).all()
    ends, (first, second) = [], (oracle._habit(oracle._env._data.qpos).astype(np.float32) for _ in range(2))
    mine = oracle._joints[0]
    for torques in (first, second, np.where(mine, first, second)):
        oracle._course(torques, None)
        ends.append(oracle._data.qpos.copy())
    np.testing.assert_allclose(ends[2], np.where(mine, ends[0], ends[1]), atol=1e-5)
    assert np.abs(ends[0] - ends[1]).max() > 0.01
    for torque in np.where(mine, first, second):
        *_, info = env.step(torque)
    np.testing.assert_allclose(info["truth"]["joint_angles"], ends[2], atol=1e-5)
