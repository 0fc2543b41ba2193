"""The mean of the maps at one time, computed when it is asked for, and only where it changed.

N particles, (X, Y, Z) voxels, T cells that are not the same to all particles.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array

if TYPE_CHECKING:
    from observer.maps.occupancy import Maps


class Changed(NamedTuple):
    """Cells that have changed since the mean was last told, and what particles believed of them.

    Attributes:
        weights: (N,) of the particles.
        cells: (C,).
        common: (C,) int8 log-odds to all particles.
        slot: (C,) where `own` has the cell; -1, its last column, in which is 0, for those in common.
        touched: (C,) whether particles may believe different things.
        own: (N, > T) int8 log-odds, each particle's own.
    """

    weights: Array
    cells: NDArray[np.int64]
    common: NDArray[np.int8]
    slot: NDArray[np.int32]
    touched: NDArray[np.bool_]
    own: NDArray[np.int8]


class UndoRecord:
    """A change of the mean. Whoever holds one can go back to the time before it.

    Attributes:
        cells: (C,).
        before: (C,) what was there.
        after: the change after it, None while it has not happened.
    """

    __slots__ = ("after", "before", "cells")

    def __init__(self) -> None:
        self.cells: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self.before: Array = np.empty(0)
        self.after: UndoRecord | None = None


class LazyMean:
    """The mean of `maps` by `weights` (N,) as it is now, whenever it is called.

    Nothing is copied until then: it keeps what changes, which is little, and undoes it.

    Attributes:
        weights: (N,).
    """

    def __init__(self, maps: Maps, weights: Array) -> None:
        """Keep what it is the mean of.

        Args:
            maps: of the particles.
            weights: (N,).
        """
        self._maps: Maps | None = maps
        self.weights = weights
        self._changed: Changed | None = None

    @property
    def waits(self) -> bool:
        """Whether the mean is still to be computed."""
        return self._maps is not None

    def put_off(self, changed: Changed) -> None:
        """Compute it later, of the maps as they were.

        Args:
            changed: what is new in them.
        """
        self._changed = changed

    def settle(self) -> None:
        """Bring the mean up to date; called before the maps change."""
        if self._maps is not None:
            self._mean, self._since = self._maps.refresh(self._changed or self._maps.changed(self.weights))
            self._maps = self._changed = None

    def __call__(self) -> Array:
        self.settle()
        happened, change = [], self._since
        while change.after is not None:
            happened.append(change)
            change = change.after
        mean = self._mean.copy()
        for each in reversed(happened):
            mean.flat[each.cells] = each.before
        return mean
