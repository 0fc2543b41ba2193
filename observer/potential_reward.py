"""What the wrappers that pay for knowing have in common."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import gymnasium as gym
from numpy.typing import NDArray


class PotentialReward(gym.Wrapper):
    """Reward of a step: by how much `potential` has risen, in place of the environment's reward.

    The sum over an episode is the potential at its end less that at its start, whatever the path (Ng, Harada & Russell
    1999, ICML), so that an episode is worth what it ends with, but a learner hears of it at once.
    """

    @abstractmethod
    def potential(self, info: dict[str, Any]) -> float:
        """What knowing as much as `info` says is worth."""

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        self._before = self.potential(info)
        return observation, info

    def step(self, action: NDArray[Any]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, _, terminated, truncated, info = self.env.step(action)
        now = self.potential(info)
        gain, self._before = now - self._before, now
        return observation, gain, terminated, truncated, info
