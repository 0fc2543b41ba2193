"""A policy some of whose joints are not driven: fingers that are splinted, or that do not take part."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.policy import EpisodeStart, Policy, State
from haptic_env import validate


class FewJoints(Policy):
    """Commands what another policy does, and no torque at all at other joints, which their springs hold."""

    def __init__(self, policy: Policy, joints: Sequence[int]) -> None:
        """Take a policy.

        Args:
            policy: that is asked.
            joints: indices of those that it drives.

        Raises:
            ValueError: for an index that is none.
        """
        self.policy, self.joints, self.name = policy, policy.joints, policy.name  # its environment was checked for it
        self.driven = np.zeros(policy.joints, dtype=bool)
        for index in joints:
            self.driven[validate.integer("joints", index, 0, policy.joints - 1)] = True

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.driven.sum()} of {self.joints} joints, of {self.policy!r}>"

    def predict(
        self, observation: Any, state: State = None, episode_start: EpisodeStart = None, deterministic: bool = False
    ) -> tuple[NDArray[np.float32], State]:
        """Decide, as the policy does.

        Args:
            observation: as the policy's.
            state: as the policy's.
            episode_start: as the policy's.
            deterministic: as the policy's.

        Returns:
            Action (J,) or (E, J) in [-1, 1], and the state to hand to the next call.
        """
        action, state = self.policy.predict(observation, state, episode_start, deterministic)
        return np.where(self.driven, action, np.float32(0.0)).astype(np.float32), state
