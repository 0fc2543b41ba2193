"""What environments share that play back what was felt: an action changes nothing, and nothing is simulated.

Shapes: J joints.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import readable
from haptic_env.hand import Hand

Observation = dict[str, Any]


class FeltPlayback(gym.Env[Observation, NDArray[np.float32]]):
    """A hand that felt what is recorded, frame by frame."""

    def __init__(self, hand: Hand, control_hz: float, frames: int) -> None:
        """Begin before the first frame.

        Args:
            hand: that felt.
            control_hz: Hz, of the frames.
            frames: how many there are.
        """
        self.hand, self.control_hz, self.episode_steps = hand, control_hz, frames - 1
        self.action_space = gym.spaces.Box(-1.0, 1.0, (hand.joints,), np.float32)
        self._steps = 0

    __repr__ = readable.environment

    @property
    def steps(self) -> int:
        """Control steps since the reset."""
        return self._steps

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Go to the first frame.

        Args:
            seed: as of every environment; nothing is drawn here.
            options: of no effect.

        Returns:
            The observation, and the info.
        """
        super().reset(seed=seed)
        self._steps = 0
        return self._observe(), self._info()

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Go to the next frame.

        Args:
            action: (J,), of no effect.

        Returns:
            As every environment: observation, reward 0, never terminated, whether truncated, info.
        """
        self._steps += 1
        return self._observe(), 0.0, False, self._steps >= self.episode_steps, self._info()

    @abstractmethod
    def _observe(self) -> Observation: ...

    @abstractmethod
    def _info(self) -> dict[str, Any]: ...
