"""Torques as they are commanded, on the steps of an observer: each holds until the next one.

Shapes: T samples, J joints. Torques are fractions of the joints' limits. Seconds.
"""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from haptic_lab.live.buffer import StreamBuffer

HOLDS = 1.0  # s, at most
DUE = 1.25  # of the interval: later than that the next one should have come


class HeldTorques:
    """A stream of torques.

    Attributes:
        samples: as they came.
        missing: steps for which none was known, and zero was told.
    """

    def __init__(self, joints: int, interval: float) -> None:
        """Begin before the first.

        Args:
            joints: J.
            interval: s, from one to the next, usually.
        """
        self.samples, self.missing = StreamBuffer(joints), 0
        self._interval = interval

    def told(self, time: float) -> bool:
        """Tell whether all are known that were commanded before a step, as far as they come steadily.

        Whoever commands by what is believed at the step commands the next one later than that: it is not waited for.

        Args:
            time: s, of the step.

        Returns:
            Whether they are.
        """
        return self.samples.newest >= time - DUE * self._interval

    def between(self, start: float, end: float) -> Array:
        """Tell what was commanded, on average, from one step to the next.

        Args:
            start: s, of the one.
            end: s, of the other.

        Returns:
            (J,) fractions, in single precision as actions are; zero while none is known.
        """
        time, values = self.samples.time, self.samples.values
        first = max(int(np.searchsorted(time, start, side="right")) - 1, 0)
        last = int(np.searchsorted(time, end))
        time, values = time[first:last], values[first:last]
        until = np.minimum(np.append(time[1:], end), time + HOLDS) if len(time) else time
        held = np.maximum(until - np.maximum(time, start), 0.0)
        if not held.any():
            self.missing += 1
            return np.zeros(values.shape[1])
        mean = held @ values / (end - start)
        return mean.clip(-1.0, 1.0).astype(np.float32).astype(np.float64)
