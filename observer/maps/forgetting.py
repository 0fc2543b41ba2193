"""Maps that fade: log-odds go back to those of the prior with the time constant of a memory.

Maps count in whole quanta, of which so little is lost from one step to the next that it would be rounded away for ever.
So they fade ten times a second, and what is not whole is rounded up as often as it is worth, by a sequence that is
spread evenly over [0, 1): on average nothing is lost but what is forgotten.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

EVERY_SECONDS = 0.1  # from one time that maps fade to the next
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)  # its multiples are spread evenly


class Fade(NamedTuple):
    """One time that maps fade.

    Attributes:
        share: that is left of what was known.
        rounding: in (0, 1), below which what is not whole is rounded down.
    """

    share: float
    rounding: float

    def of(self, quanta: NDArray[Any]) -> NDArray[Any]:
        """Let log-odds fade.

        Args:
            quanta: whole ones, above those of the prior.

        Returns:
            What is left of them, of the same kind.
        """
        return np.floor(quanta * self.share + self.rounding).astype(quanta.dtype)

    def of_bytes(self, quanta: NDArray[np.int8]) -> NDArray[np.int8]:
        """Let many fade.

        Args:
            quanta: as `of` takes them.

        Returns:
            The same as `of` does, sooner.
        """
        return self.of(np.arange(256).astype(np.uint8).view(np.int8))[quanta.view(np.uint8)]


class Forgetting:
    """When the maps of a trial fade.

    Attributes:
        steps: that there were.
    """

    def __init__(self, memory_seconds: float = np.inf, control_hz: float = 50.0) -> None:
        """Begin before the first step.

        Args:
            memory_seconds: s, the time constant; inf: nothing is forgotten.
            control_hz: Hz, of the steps.
        """
        self._every = max(1, round(EVERY_SECONDS * control_hz))
        self._share = float(np.exp(-self._every / control_hz / memory_seconds)) if memory_seconds < np.inf else 1.0
        self.steps = 0

    def step(self) -> None:
        """Let a step pass."""
        self.steps += 1

    @property
    def now(self) -> Fade | None:
        """What is left at this step of what was known; None: all."""
        turns, rest = divmod(self.steps, self._every)
        return None if rest or self._share == 1.0 else Fade(self._share, turns * GOLDEN % 1.0)
