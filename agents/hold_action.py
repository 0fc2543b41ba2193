"""Fewer decisions than control steps."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from observer.wrappers.stepped_apart import apart


class HeldSpace(gym.spaces.Box):
    """The Box of an action, which knows for how long it is held, and so does whatever is saved with it.

    Attributes:
        held: control steps.
    """

    def __init__(self, space: gym.Space[Any], held: int) -> None:
        """Take the bounds of a space.

        Args:
            space: a Box.
            held: control steps of each action.
        """
        assert isinstance(space, gym.spaces.Box)
        super().__init__(space.low, space.high, space.shape, space.dtype.type)
        self.held = held


class HoldAction(gym.Wrapper, gym.utils.RecordConstructorArgs):
    """Holds each action for `steps` control steps; their rewards add up.

    A learner then decides every 0.1 s, say, not every 0.02 s: what it tries at random lasts long enough to move the
    hand. `agents.make("sb3", …)` holds the actions of a model as it was trained to.
    """

    def __init__(self, env: gym.Env[Any, Any], steps: int = 5) -> None:
        """Wrap `env`.

        Args:
            env: whose actions are held.
            steps: control steps that each action lasts, 1 at least.

        Raises:
            ValueError: for another number of steps.
        """
        gym.utils.RecordConstructorArgs.__init__(self, steps=steps)
        gym.Wrapper.__init__(self, env)
        self.held = validate.integer("steps", steps, 1)
        self.action_space = HeldSpace(env.action_space, self.held)

    def step(self, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Hold an action for `steps` control steps.

        Args:
            action: (J,) torque as a fraction of each joint's limit.

        Returns:
            As of `gymnasium.Env.step`, after the last of these steps: the rewards are added, an end ends the hold.
        """
        total, inside = 0.0, apart(self.env)
        for _ in range(self.held):
            if inside is None:
                observation, reward, terminated, truncated, info = self.env.step(action)
            else:
                reward, terminated, truncated = inside.advance(action)
            total += float(reward)
            if terminated or truncated:
                break
        if inside is not None:  # what is to be seen of the steps between nobody sees
            observation, info = inside.told()
        return observation, total, terminated, truncated, info
