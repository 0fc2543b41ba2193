"""End an exploration when its question is answered."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from observer.wrappers.belief_observation import labels_of
from observer.wrappers.stepped_apart import SteppedApart


class DecideWhenSure(SteppedApart, gym.utils.RecordConstructorArgs):
    """Ends the episode (`terminated`) when one name has been probable for long enough.

    `info["decision"]` is then that name, which need not be true.
    """

    def __init__(self, env: gym.Env[Any, Any], threshold: float = 0.95, seconds: float = 0.0) -> None:
        """Check the arguments.

        Args:
            env: with an `ObserverWrapper` that names the object.
            threshold: probability that the name has to exceed.
            seconds: s, for how long.

        Raises:
            ValueError: for a value out of range, or where nothing names the object.
        """
        gym.utils.RecordConstructorArgs.__init__(self, threshold=threshold, seconds=seconds)
        gym.Wrapper.__init__(self, env)
        self._threshold = validate.number("threshold", threshold, 0.0, 1.0)
        self._seconds = validate.seconds("seconds", seconds, above=None)
        self._labels = labels_of(env)
        base: Any = env.unwrapped
        self._decision: str | None = None
        self._patience = max(1, round(self._seconds * base.control_hz))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: as the environment's.
            options: as the environment's.

        Returns:
            What the environment gives.
        """
        self._sure, self._decision = 0, None
        return self.env.reset(seed=seed, options=options)

    def advance(self, action: NDArray[np.float32]) -> tuple[Any, bool, bool]:
        reward, terminated, truncated = self.advance_inside(action)
        posterior = self.posterior_now()
        best = int(np.argmax(posterior))
        self._sure = self._sure + 1 if posterior[best] > self._threshold else 0
        self._decision = self._labels[best] if self._sure >= self._patience else None
        return reward, terminated or self._decision is not None, truncated

    def told(self) -> tuple[Any, dict[str, Any]]:
        observation, info = self.told_inside()
        return observation, info if self._decision is None else {**info, "decision": self._decision}
