"""The time of a stream's samples, on one line whatever its clock does. Seconds."""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from haptic_env.recordings.merging import LATE


class StreamClock:
    """Maps the stamps of a stream to the time line of all.

    A clock that steps, of a sender that begins anew or is set, goes on where it would be had it not. What comes in a
    burst is as late as its stamps say: that is no step.

    Attributes:
        steps: how often it has stepped.
    """

    def __init__(self) -> None:
        """Begin before the first sample."""
        self.steps = 0
        self._offset = 0.0
        self._last: float | None = None  # on the line of all
        self._heard = 0.0

    def begin(self, stamp: float, now: float) -> None:
        """Make it go with a line that is there already, where it is far from that.

        Args:
            stamp: s, of the newest of its first samples.
            now: s, on the line.
        """
        if abs(stamp - now) > LATE:
            self._offset = now - stamp
            self.steps += 1

    def expected(self, arrival: float) -> float | None:
        """Tell what time it is on the line.

        Args:
            arrival: s, by this machine.

        Returns:
            s; None: before the first sample.
        """
        return None if self._last is None else self._last + (arrival - self._heard)

    def mapped(self, stamps: Array, arrival: float) -> Array:
        """Map stamps.

        Args:
            stamps: (T,) s, by the stream.
            arrival: s, by this machine, when they came.

        Returns:
            (T,) s, on the line.
        """
        result, due = np.empty(len(stamps)), self.expected(arrival)
        for index, stamp in enumerate(stamps):
            time, last = float(stamp) + self._offset, self._last
            if last is not None and due is not None and (time < last - LATE or time > max(due, last) + LATE):
                due = max(due, last)
                self._offset += due - time
                self.steps += 1
                time = due
            result[index] = time
            self._last = time if last is None else max(last, time)
        self._heard = arrival
        return result
