"""What a real hand felt, told step by step; nothing is simulated, and nobody knows the truth.

Shapes: J joints, P patches. NaN: not measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.recordings.measured import MeasuredTouch
from haptic_env.shapes.base import Solid

Observation = dict[str, Any]


class MeasuredPlayback(gym.Env[Observation, NDArray[np.float32]]):
    """A hand that moved and felt what is recorded: an action changes nothing."""

    def __init__(self, recording: MeasuredTouch, solid: Solid | None = None) -> None:
        """Begin before the first step.

        Args:
            recording: with measured touch.
            solid: what was touched, where it is told; None: nobody says.

        Raises:
            ValueError: for what is no such recording.
        """
        validate.instance("recording", recording, MeasuredTouch, "a MeasuredTouch, as read_measured gives")
        self.recording, self.hand, self.solid = recording, recording.hand, solid
        self.control_hz = recording.control_hz
        self.episode_steps = len(recording) - 1
        self.action_space = gym.spaces.Box(-1.0, 1.0, (self.hand.joints,), np.float32)
        self._steps = 0

    @property
    def steps(self) -> int:
        """Control steps since the reset."""
        return self._steps

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Go to the first step.

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
        """Go to the next step.

        Args:
            action: (J,), of no effect.

        Returns:
            As every environment: observation, reward 0, never terminated, whether truncated, info.
        """
        self._steps += 1
        return self._observe(), 0.0, False, self._steps >= self.episode_steps, self._info()

    def _observe(self) -> Observation:
        told = self.recording
        return {"joint_angles": told.joint_angles[self._steps].copy(), "contacts": told.contacts[self._steps].copy()}

    def _info(self) -> dict[str, Any]:
        return {"solid": self.solid}
