"""Steps in two parts, so that what nobody looks at is not made: most steps of an action that is held.

Shapes: C labels.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray


class SteppedApart(gym.Wrapper):
    """A wrapper whose step is `advance`, after which the world has moved on, and `told`, what there is to see then."""

    _asked: gym.Env[Any, Any] | None = None
    _inside_apart: SteppedApart | None = None

    @property
    def apart_inside(self) -> SteppedApart | None:
        """The environment inside where it is stepped in two parts; asked at every step."""
        if self._asked is not self.env:
            self._asked, self._inside_apart = self.env, apart(self.env)
        return self._inside_apart

    @abstractmethod
    def advance(self, action: NDArray[Any]) -> tuple[Any, bool, bool]:
        """Take a step.

        Args:
            action: of the environment.

        Returns:
            The reward, whether the episode is terminated, and whether it is truncated.
        """

    @abstractmethod
    def told(self) -> tuple[Any, dict[str, Any]]:
        """Say what is to be seen after the last step.

        Returns:
            The observation and the info.
        """

    def posterior_now(self) -> NDArray[np.float64]:
        """Give `info["posterior"]`.

        Returns:
            (C,) probability of each label.
        """
        inside = self.apart_inside
        return self.told_inside()[1]["posterior"] if inside is None else inside.posterior_now()

    def step(self, action: NDArray[Any]) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Take a step.

        Args:
            action: of the environment.

        Returns:
            Observation, reward, whether terminated and whether truncated, info.
        """
        reward, terminated, truncated = self.advance(action)
        observation, info = self.told()
        return observation, reward, terminated, truncated, info

    def advance_inside(self, action: NDArray[Any]) -> tuple[Any, bool, bool]:
        """Take a step of the environment inside.

        Args:
            action: of the environment.

        Returns:
            As `advance`.
        """
        inside = self.apart_inside
        if inside is not None:
            return inside.advance(action)
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._seen = observation, info
        return reward, terminated, truncated

    def told_inside(self) -> tuple[Any, dict[str, Any]]:
        """Say what is to be seen of the environment inside.

        Returns:
            As `told`.
        """
        inside = self.apart_inside
        return self._seen if inside is None else inside.told()


def apart(env: gym.Env[Any, Any]) -> SteppedApart | None:
    """Tell whether an environment is stepped in two parts.

    Args:
        env: any.

    Returns:
        It, or None where it is not, or its step is one of its own.
    """
    return env if isinstance(env, SteppedApart) and type(env).step is SteppedApart.step else None
