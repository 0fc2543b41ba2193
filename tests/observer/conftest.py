"""A hand that explores with an observer, and beliefs compared bit by bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import agents
import haptic_env  # noqa: F401 - registers
from haptic_env import hands
from observer import Belief, HapticSLAM


@pytest.fixture(scope="session")
def two_finger():
    """The two-finger hand."""
    return hands.make("two_finger")


class Exploration:
    """What was commanded, felt and true at each of T steps; the rest pose comes before the first.

    `torque` (T, J), `felt` (T, J) rad, `contacts` (T, P), `true` (T, J) rad, `solid`.
    """

    def __init__(self, shape: str, steps: int, seed: int = 0, **keywords: Any) -> None:
        env = gym.make("HapticSLAM/TwoFinger-v0", shape=shape, reveal_truth=True, episode_seconds=60.0, **keywords)
        observation, _ = env.reset(seed=seed)
        policy, state = agents.make("random_torque", env, seed=seed), None
        rows = []
        for _ in range(steps):
            action, state = policy.predict(observation, state)
            observation, *_, info = env.step(action)
            truth = info["truth"]["joint_angles"]
            rows.append((action, observation["joint_angles"], observation["contacts"], truth))
        self.torque, self.felt, self.contacts, self.true = (np.array(each) for each in zip(*rows, strict=True))
        self.solid = env.unwrapped.solid  # type: ignore[attr-defined]
        self.hand = env.unwrapped.hand  # type: ignore[attr-defined]
        env.close()

    def beliefs(self, observer: HapticSLAM, *, truth: bool = False, seed: int = 0) -> list[Belief]:
        """Every belief of `observer`, those of the reset and the flush included; with `truth` it feels true angles."""
        result = [observer.reset(seed=seed)]
        for each in zip(self.torque, self.true if truth else self.felt, self.contacts, strict=True):
            result.append(observer.step(*each))
        return result + observer.flush()

    def lagged_rmse(self, beliefs: list[Belief]) -> float:
        """RMS error (rad) over steps and joints of the lagged angles of all steps but the rest pose."""
        steps = len(self.true)
        errors = [
            belief.lagged_joint_angles - self.true[step - 1]
            for now, belief in enumerate(beliefs)
            if belief.lagged_contacts is not None and (step := min(now, steps) - belief.lag_steps) > 0
        ]
        return float(np.sqrt(np.mean(np.square(errors))))


@pytest.fixture(scope="session")
def explore() -> Callable[..., Exploration]:
    """Makes an `Exploration`, each once."""
    made: dict[Any, Exploration] = {}

    def run(shape: str, steps: int, seed: int = 0, **keywords: Any) -> Exploration:
        key = (shape, steps, seed, *sorted(keywords.items()))
        if key not in made:
            made[key] = Exploration(shape, steps, seed, **keywords)
        return made[key]

    return run


@pytest.fixture(scope="session")
def bits() -> Callable[[Belief], dict[str, bytes]]:
    """All of a belief as bytes, to be compared with another's."""

    def of(belief: Belief) -> dict[str, bytes]:
        names = [name for name in belief.__dataclass_fields__ if name not in ("snapshot", "grid", "transition")]
        parts = {name: np.asarray(getattr(belief, name)).tobytes() for name in (*names, "occupancy")}
        return parts | {f"transition {i}": part.tobytes() for i, part in enumerate(belief.transition or ())}

    return of
