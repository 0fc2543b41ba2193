"""Every registered environment, and ways to play it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import agents
import haptic_env
from haptic_env.hand import Hand
from haptic_env.hands import two_finger

PROBE = """
<mujoco>
  <worldbody>
    <body name="probe">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/><geom name="probe" type="sphere" size="0.004"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(params=list(haptic_env.ENVIRONMENTS))
def env_id(request: pytest.FixtureRequest) -> str:
    """Each registered id in turn."""
    return str(request.param)


@pytest.fixture(scope="session")
def display() -> bool:
    """Whether a window can be opened."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import glfw

        return bool(glfw.init())


@pytest.fixture
def make() -> Iterator[Any]:
    """`gym.make`, and every environment that it made is closed in the end."""
    made: list[gym.Env] = []

    def build(env_id: str, **keywords: Any) -> gym.Env:
        made.append(gym.make(env_id, **keywords))
        return made[-1]

    yield build
    for env in made:
        env.close()


@pytest.fixture
def play() -> Any:
    """Play an environment with the random policy and record everything that it returns."""

    def run(env: gym.Env, seed: int, steps: int, **options: Any) -> list[Any]:
        observation, info = env.reset(seed=seed, options=options or None)
        policy, state = agents.make("random_torque", env, seed=seed), None
        record: list[Any] = [(observation, 0.0, False, False, info)]
        for _ in range(steps):
            action, state = policy.predict(observation, state)
            record.append(env.step(action))
            observation = record[-1][0]
        return record

    return run


@pytest.fixture
def same() -> Any:
    """Whether two nested results are the same bits."""

    def equal(first: Any, second: Any) -> bool:
        if isinstance(first, dict):
            return first.keys() == second.keys() and all(equal(first[key], second[key]) for key in first)
        if isinstance(first, list | tuple):
            return len(first) == len(second) and all(map(equal, first, second))
        if isinstance(first, np.ndarray):
            return first.dtype == second.dtype and first.tobytes() == second.tobytes()
        return bool(first == second)

    return equal


@pytest.fixture
def probe() -> Hand:
    """A ball of 4 mm that goes anywhere, in whose scene an object lies as in that of a hand."""
    hand = two_finger.make()
    object.__setattr__(hand, "xml", PROBE)
    return hand
