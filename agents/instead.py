"""What a network is shown in place of some of what it would see, to find out what it reads (`agents.ablation`).

Shapes: D numbers of an observation, C of them replaced, N episodes, T decisions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.layers import Array
from haptic_env import validate


class Instead(NamedTuple):
    """What a network is shown in place of some numbers of an observation.

    Attributes:
        columns: (C,) of the observation.
        shown: (N, T, C), for each of N episodes T decisions; the last one from then on.
    """

    columns: NDArray[np.int64]
    shown: Array

    def put(self, observation: NDArray[np.float32], episode: int, decision: int) -> NDArray[np.float32]:
        """Put them in place.

        Args:
            observation: (D,).
            episode: index.
            decision: how many there were.

        Returns:
            (D,), a copy.
        """
        result = observation.copy()
        result[self.columns] = self.shown[episode, min(decision, self.shown.shape[1] - 1)]
        return result


def instead(columns: Any, width: int, take: Callable[..., NDArray[Any]]) -> Instead:
    """Read it of a file.

    Args:
        columns: as the file tells them.
        width: D.
        take: takes an array of the file by its name and shape.

    Returns:
        What is shown.

    Raises:
        ValueError: for columns that the observation lacks, and for arrays that do not fit.
    """
    if not isinstance(columns, list) or not columns:
        raise ValueError(f"what it is blind to must be a list of columns, got {columns!r}")
    chosen = [validate.integer("column", column, 0, width - 1) for column in columns]
    shown = take("instead", None, None, len(chosen))
    if not shown.size:
        raise ValueError("what it is shown instead is nothing")
    return Instead(np.array(chosen, np.int64), shown)
