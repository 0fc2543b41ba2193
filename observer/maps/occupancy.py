"""The maps of all particles, and their mean, which is computed when it is asked for and only where it changed.

N particles, (X, Y, Z) voxels, V = X·Y·Z, T cells that are not the same to all particles.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.moved import renamed
from observer.maps.cells import flagged, mark, mean_probability, settle, spread
from observer.maps.forgetting import Fade
from observer.maps.lazy_mean import Changed, LazyMean, UndoRecord
from observer.surface.touches import TouchLog

__getattr__ = renamed(__name__, {"Then": "LazyMean", "Change": "UndoRecord"})

FIRST_SLOTS = 256
WORTH_A_COPY = 50_000  # numbers that a mean is of: it then takes as long as a copy of the maps


class ParticleMaps(NamedTuple):
    """The maps of all particles, for the kernels. Log-odds are int8 in units of `QUANTUM`; of `common` and `own` a cell
    has its log-odds in one and 0 in the other, so that their sum is what a particle believes.

    Attributes:
        shape: (X, Y, Z).
        common: (V,) int8, to all particles; 0 for the cells that have a slot.
        slot: (V,) int32, where `own` has a cell; -1, its last column, in which is 0, for the others.
        own: (N, > T) int8, each particle's own.
        touched: (V,) the cells of which particles may believe different things.
        solid: (V,) those that any particle holds for occupied rather than free.
        seen: (V,) those that the hand came near, of which and of whose neighbours something is told.
        stale: (V,) those whose mean has changed since it was last asked for.
    """

    shape: NDArray[np.int64]
    common: NDArray[np.int8]
    slot: NDArray[np.int32]
    own: NDArray[np.int8]
    touched: NDArray[np.bool_]
    solid: NDArray[np.bool_]
    seen: NDArray[np.bool_]
    stale: NDArray[np.bool_]


class OccupancySnapshot:
    """The occupancy of one step, computed when it is first asked for.

    Attributes:
        touches: what it was touched with until then; None where no map is made.
    """

    def __init__(self, compute: Callable[[], Array], touches: TouchLog | None = None) -> None:
        """Keep what computes it.

        Args:
            compute: gives (X, Y, Z), and is called once at most.
            touches: what it was touched with until then.
        """
        self.touches = touches
        self._compute: Callable[[], Array] | None = compute
        self._value: Array | None = None

    def value(self) -> Array:
        """Compute it, or recall it.

        Returns:
            (X, Y, Z) posterior probability that each voxel is occupied, 0.5 where the hand never came; read-only.
        """
        if self._compute is not None:
            self._value = self._compute()
            self._value.flags.writeable = False
            self._compute = None
        assert self._value is not None
        return self._value

    def __getstate__(self) -> dict[str, Any]:
        """To another process goes the value."""
        return {"touches": self.touches, "_compute": None, "_value": self.value()}


class Maps:
    """What the particles believe of every voxel: a map in common, and each particle's own of the cells that a touch
    may have been due to.

    Attributes:
        arrays: the `ParticleMaps`, whose arrays are also attributes of this one.
        cells: (T,) the cells of the slots.
    """

    def __init__(self, particles: int, grid: Grid, probability: Array, dense: bool = False) -> None:
        """Begin with nothing known.

        Args:
            particles: N.
            grid: of the maps.
            probability: (256,) that a voxel is occupied, of a map entry v at [v + 128].
            dense: whether every cell has a slot, in order.
        """
        count = int(np.prod(grid.shape))
        self.common = np.zeros(count, dtype=np.int8)
        self.slot = np.arange(count, dtype=np.int32) if dense else np.full(count, -1, dtype=np.int32)
        self._kept = np.arange(count) if dense else np.zeros(FIRST_SLOTS, dtype=np.int64)
        self.cells = self._kept if dense else self._kept[:0]
        self.own = np.zeros((particles, count if dense else FIRST_SLOTS), dtype=np.int8)
        self.touched = np.full(count, dense)
        self.solid, self.seen, self.stale = np.zeros((3, count), dtype=bool)
        self._shape = np.array(grid.shape)
        self.arrays = self._arrays()
        self._told = np.zeros(count, dtype=np.int8)
        self._probability = probability
        self._mean = np.full(grid.shape, 0.5)
        self._next = UndoRecord()
        self._last: weakref.ref[LazyMean] | None = None
        self._put_off: weakref.ref[LazyMean] | None = None
        self._late: Changed | None = None  # of which the mean is put off, or was
        self._dense = dense

    def __getstate__(self) -> dict[str, Any]:
        """A copy goes on as this one would, bit for bit; the last snapshot, which stays this one's, is settled."""
        self.catch_up()
        last = _held(self._last)
        if last is not None:
            last.settle()
        return {**vars(self), "_last": None, "_late": None}

    def before_change(self) -> None:
        """Settle the last snapshot, if anyone still holds it.

        Whoever asks step by step holds each until the next one comes, and looks at few. Where the mean is costly it is
        put off until then, and the maps are copied for it; but not once weights stay, for then it is cheap from now on.
        """
        last, self._last = _held(self._last), None
        if last is None or not last.waits:
            return
        changed = self.changed(last.weights)
        stay = self._late is not None and np.array_equal(changed.weights, self._late.weights)
        if stay or self._dense or len(changed.cells) * len(self.own) < WORTH_A_COPY:
            last.put_off(changed)
            last.settle()
        else:
            self._late = changed._replace(own=self._own_copied())
            last.put_off(self._late)
            self._put_off = weakref.ref(last)

    def catch_up(self) -> None:
        """Compute the mean that was put off, if anyone still holds it."""
        late, waits, self._put_off = _held(self._put_off), self._put_off is not None, None
        if late is not None:
            late.settle()
        elif waits and self._late is not None:
            self.stale[self._late.cells] = True

    def make_room(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        """Give a slot to each cell that has none, and take note that they change.

        Args:
            cells: (C,).

        Returns:
            (C,) the slots.
        """
        used = len(self.cells)
        if used + len(cells) >= self.own.shape[1]:
            room = 2 * (used + len(cells))
            self._kept = np.append(self.cells, np.zeros(room - used, dtype=np.int64))
            own = np.zeros((len(self.own), room), dtype=np.int8)
            own[:, :used] = self.own[:, :used]
            self.own = own
            self.arrays = self._arrays()
        where, used = settle(cells, used, self._kept, self.arrays)
        self.cells = self._kept[:used]
        return where

    def weights_changed(self) -> None:
        """Take note that the mean changes wherever particles differ."""
        mark(self.cells, self.arrays)

    def fade(self, fade: Fade) -> None:
        """Forget some of what is believed.

        Args:
            fade: what is left.
        """
        used = len(self.cells)
        self.common[:], self.own[:, :used] = fade.of_bytes(self.common), fade.of_bytes(self.own[:, :used])
        self.stale |= self.seen

    def copy(self, source: NDArray[np.int64], target: NDArray[np.int64]) -> None:
        """Overwrite maps by others.

        Args:
            source: (C,) particles.
            target: (C,) those that get their maps; none may be in both.
        """
        used = len(self.cells)
        self.own[target, :used] = self.own[source, :used]

    def snapshot(self, weights: Array, touches: TouchLog | None = None) -> OccupancySnapshot:
        """Take the mean of the maps, as it is now.

        Args:
            weights: (N,).
            touches: what the maps were touched with.

        Returns:
            The mean, computed when it is asked for.
        """
        then = _held(self._last)
        if then is None:
            then = LazyMean(self, weights)
            self._last = weakref.ref(then)
        return OccupancySnapshot(then, touches)

    def changed(self, weights: Array) -> Changed:
        """Tell of which cells the mean is to be told anew, all of which the hand came near; they count as told.

        Args:
            weights: (N,).

        Returns:
            They, and the maps as they are now, of which nothing is copied.
        """
        self.catch_up()
        cells = flagged(self.stale)
        self.stale[cells] = False
        return Changed(weights, cells, self.common[cells], self.slot[cells], self.touched[cells], self.own)

    def refresh(self, changed: Changed) -> tuple[Array, UndoRecord]:
        """Bring the mean of the maps up to date.

        Args:
            changed: the cells since the last time.

        Returns:
            The mean (X, Y, Z), which changes with the maps, and its next change.
        """
        if changed is self._late:
            self._put_off = None
        weights, cells, common, where, differs, own = changed
        beside = spread(cells, self._mean.shape, self._told)  # where the hand never was, so that nothing is known
        mean = self._probability[common.astype(np.int64) + own[0, where] + 128]  # any particle's, where they agree
        mean[differs] = mean_probability(where[differs], own, weights, self._probability)
        mean = np.append(mean, np.full(len(beside), self._probability[128]))
        cells = np.append(cells, beside)
        change, self._next = self._next, UndoRecord()
        change.cells, change.before, change.after = cells, self._mean.flat[cells], self._next
        self._mean.flat[cells] = mean
        return self._mean, self._next

    def _own_copied(self) -> NDArray[np.int8]:
        """What particles believe now; where the last copy was is written over."""
        used, last = len(self.cells), self._late
        copy = last.own if last is not None and last.own.shape == self.own.shape else np.zeros_like(self.own)
        copy[:, :used] = self.own[:, :used]
        return copy

    def _arrays(self) -> ParticleMaps:
        of_cells = self.touched, self.solid, self.seen, self.stale
        return ParticleMaps(self._shape, self.common, self.slot, self.own, *of_cells)


def _held(mean: weakref.ref[LazyMean] | None) -> LazyMean | None:
    return None if mean is None else mean()
