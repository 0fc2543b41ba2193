"""What was felt at a step that has not entered the maps yet.

Shapes: P patches.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from haptic_env.pose import Pose


class Waiting(NamedTuple):
    """A step that waits for the lag.

    Attributes:
        contacts: (P,) that were felt.
        root: where the hand as a whole was; None where it does not move.
        unmeasured: (P,) patches whose contact was not measured, or is not known; None: all were.
    """

    contacts: NDArray[np.bool_]
    root: Pose | None
    unmeasured: NDArray[np.bool_] | None = None

    def touching(self, touched: NDArray[np.bool_], doubted: NDArray[np.bool_]) -> Self:
        """Say in hindsight which patches were touched.

        Args:
            touched: (P,), of which those that were not measured do not count.
            doubted: (P,) patches that are believed not to work, which say nothing.

        Returns:
            The step.
        """
        unknown = doubted if self.unmeasured is None else doubted | self.unmeasured
        if not unknown.any():
            return self._replace(contacts=touched)
        return self._replace(contacts=touched & ~unknown, unmeasured=unknown)
