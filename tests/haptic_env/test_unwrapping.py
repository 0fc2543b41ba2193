"""The hand of an environment is found beneath its wrappers, or what was given is refused."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import pytest

import haptic_env
from haptic_env.hand import Hand


@pytest.mark.parametrize(
    "wrap",
    [lambda env: env, lambda env: env.unwrapped, gym.wrappers.FlattenObservation, lambda env: gym.Wrapper(env)],
)
def test_it_is_found_beneath_wrappers(wrap: Callable[[Any], Any]) -> None:
    env = gym.make("HapticSLAM/TwoFinger-v0", control_hz=100.0, episode_seconds=2.0)
    hand, base = haptic_env.hand_of(wrap(env)), haptic_env.hand_env(wrap(env))
    assert isinstance(hand, Hand)
    assert hand is base.hand is env.unwrapped.hand
    assert (base.control_hz, base.episode_steps) == (100.0, 200)


@pytest.mark.parametrize(
    "given",
    [
        None,
        "HapticSLAM/TwoFinger-v0",
        gym.make("CartPole-v1"),
        gym.make_vec("CartPole-v1", num_envs=2),
        SimpleNamespace(unwrapped=SimpleNamespace(hand=None)),
        haptic_env,
    ],
    ids=lambda each: type(each).__name__,
)
@pytest.mark.parametrize("find", [haptic_env.hand_of, haptic_env.hand_env])
def test_what_has_none_is_refused(find: Callable[[Any], Any], given: Any) -> None:
    with pytest.raises(ValueError, match=r"^env must be one environment with a hand, such as") as told:
        find(given)
    assert repr(given)[:30] in str(told.value)


def test_registering_loads_no_simulator() -> None:
    look = "import sys, haptic_env; print({'mujoco', 'numba', 'dm_control'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", look], capture_output=True, text=True).stdout == "set()\n"
