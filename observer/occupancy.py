"""The maps of all particles, and their mean, which is computed when it is asked for and only where it changed.

N particles, (X, Y, Z) voxels, V = X·Y·Z.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.grid import Grid
from observer import kernels

Array = NDArray[np.float64]


class OccupancySnapshot:
    """The occupancy of one step, computed when it is first asked for, or just before the maps change."""

    def __init__(self, compute: Callable[[], Array]) -> None:
        self._compute: Callable[[], Array] | None = compute
        self._value: Array | None = None

    def value(self) -> Array:
        """(X, Y, Z) posterior probability that each voxel is occupied, 0.5 where the hand never came; read-only."""
        if self._compute is not None:
            self._value = self._compute()
            self._value.flags.writeable = False
            self._compute = None
        assert self._value is not None
        return self._value

    def __getstate__(self) -> dict[str, Any]:
        """To another process goes the value."""
        return {"_compute": None, "_value": self.value()}


class Maps:
    """`log_odds` (N, X, Y, Z) int8 for the kernels, which set `written` (V,) where they changed any of them; `seen`
    (V,): the cells that the hand came near. What is neither seen nor written is told as 0.5."""

    def __init__(self, particles: int, grid: Grid, probability: Array) -> None:
        """`probability` (256,) that a voxel is occupied, of an entry v at [v + 128]."""
        self.log_odds = np.zeros((particles, *grid.shape), dtype=np.int8)
        self.written = np.zeros(self.log_odds[0].size, dtype=bool)
        self.seen = np.zeros(self.log_odds[0].size, dtype=bool)
        self._probability = probability
        self._ever_written = self.written.copy()
        self._stale = self.written.copy()
        self._mean = np.full(grid.shape, 0.5)
        self._snapshot: weakref.ref[OccupancySnapshot] | None = None

    def before_change(self) -> None:
        """Let the last snapshot take its value, if anyone still holds it."""
        snapshot = self._held()
        if snapshot is not None:
            snapshot.value()
        self._snapshot = None

    def see(self, cells: NDArray[np.bool_]) -> None:
        """`cells` (V,) are near the hand: what is not known of them otherwise is their prior."""
        self._stale |= cells & ~self.seen
        self.seen |= cells

    def after_change(self, weights_changed: bool) -> None:
        """Take note of what was `written`; of all that ever was, where the particles' weights changed as well."""
        self._ever_written |= self.written
        self._stale |= self._ever_written if weights_changed else self.written
        self.written[:] = False

    def snapshot(self, weights: Array) -> OccupancySnapshot:
        """The mean of the maps by `weights` (N,)."""
        snapshot = self._held()
        if snapshot is None:
            snapshot = OccupancySnapshot(lambda: self._refresh(weights).copy())
            self._snapshot = weakref.ref(snapshot)
        return snapshot

    def _refresh(self, weights: Array) -> Array:
        cells = np.flatnonzero(self._stale)
        self._mean.flat[cells] = kernels.mean_probability(self.log_odds, weights, cells, self._probability)
        self._stale[:] = False
        return self._mean

    def _held(self) -> OccupancySnapshot | None:
        return None if self._snapshot is None else self._snapshot()
