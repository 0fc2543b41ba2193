"""The samples of a stream that still count, in the order of their time. To add one costs the same however many wait.

Shapes: T samples, C columns. Seconds. NaN: not measured.
"""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from haptic_env.recordings.merging import Samples, rising
from haptic_lab.live.clock import StreamClock

ROOM = 256  # samples that are made room for at first


class StreamBuffer:
    """Samples that come, most of them later than all before.

    Attributes:
        clock: maps their stamps to the line of all streams.
        heard: s, when any came last, by this machine; None: none has.
    """

    def __init__(self, width: int) -> None:
        """Begin without any.

        Args:
            width: C.
        """
        self.clock = StreamClock()
        self.heard: float | None = None
        self._time, self._values = np.empty(ROOM), np.empty((ROOM, width))
        self._first = self._last = 0

    def __len__(self) -> int:
        return self._last - self._first

    @property
    def time(self) -> Array:
        """(T,) s, rising."""
        return self._time[self._first : self._last]

    @property
    def values(self) -> Array:
        """(T, C)."""
        return self._values[self._first : self._last]

    @property
    def newest(self) -> float:
        """The time of the last, s; minus infinity where there is none."""
        return float(self._time[self._last - 1]) if len(self) else -np.inf

    def add(self, time: Array, values: Array) -> int:
        """Take samples in; of those with one time the first is kept.

        Args:
            time: (T,) s.
            values: (T, C), of which those that are all NaN are left out.

        Returns:
            How many there were already.
        """
        known = np.isfinite(values).any(axis=1)
        if not known.all():
            time, values = time[known], values[known]
        if not len(time):
            return 0
        repeated = 0
        if len(time) > 1 or time[0] <= self.newest:
            place = self._first + int(np.searchsorted(self.time, time.min()))
            rows = slice(place, self._last)
            every = rising(np.concatenate([self._time[rows], time]), np.concatenate([self._values[rows], values]))
            self._last, time, values, repeated = place, every.time, every.values, every.repeated
        self._make_room(len(time))
        rows = slice(self._last, self._last + len(time))
        self._time[rows], self._values[rows] = time, values
        self._last = rows.stop
        return repeated

    def forget(self, before: float) -> None:
        """Let go of samples.

        Args:
            before: s, of all before.
        """
        self._first += int(np.searchsorted(self.time, before))

    def about(self, low: float, high: float) -> Samples:
        """Give those of a while.

        Args:
            low: s, from when.
            high: s, until when.

        Returns:
            The samples.
        """
        rows = slice(np.searchsorted(self.time, low), np.searchsorted(self.time, high, side="right"))
        return Samples(self.time[rows], self.values[rows])

    def _make_room(self, more: int) -> None:
        """Move all to the front, to twice the room where half of it is not enough."""
        if self._last + more <= len(self._time):
            return
        count = len(self)
        room = max(ROOM, 2 * (count + more))
        time, values = np.empty(room), np.empty((room, self._values.shape[1]))
        time[:count], values[:count] = self.time, self.values
        self._time, self._values, self._first, self._last = time, values, 0, count
