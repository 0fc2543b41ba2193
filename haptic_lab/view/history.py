"""The lines that were told so far, for whoever comes late; of a long session not all."""

from __future__ import annotations

import threading
from bisect import bisect_right
from typing import NamedTuple

MOST = {"state": 6000, "map": 300, "surface": 80}  # of each kind; of more, every second of the old ones goes


class Line(NamedTuple):
    """A line that was told.

    Attributes:
        serial: counts lines.
        kind: of line.
        text: without its end.
    """

    serial: int
    kind: str
    text: str


class History:
    """Written by one thread, read by several.

    Attributes:
        ended: whether no more lines will come.
    """

    def __init__(self) -> None:
        self.ended = False
        self._lines: list[Line] = []
        self._counts: dict[str, int] = {}
        self._next = 0
        self._changed = threading.Condition()

    def add(self, kind: str, text: str) -> None:
        """Tell a line.

        Args:
            kind: of line.
            text: without its end.
        """
        with self._changed:
            self._lines.append(Line(self._next, kind, text))
            self._next += 1
            self._counts[kind] = self._counts.get(kind, 0) + 1
            if self._counts[kind] > MOST.get(kind, self._counts[kind]):
                self._thin(kind)
            self._changed.notify_all()

    def close(self) -> None:
        """Tell readers that no more will come."""
        with self._changed:
            self.ended = True
            self._changed.notify_all()

    def texts(self) -> list[str]:
        """Hand out all lines.

        Returns:
            Their texts.
        """
        with self._changed:
            return [each.text for each in self._lines]

    def after(self, serial: int, seconds: float) -> list[Line]:
        """Wait for lines.

        Args:
            serial: of the last line that is known; -1: none is.
            seconds: to wait at most.

        Returns:
            The lines since; none where none came, or where no more will.
        """
        with self._changed:
            self._changed.wait_for(lambda: self.ended or self._next > serial + 1, seconds)
            return self._lines[bisect_right(self._lines, serial, key=lambda each: each.serial) :]

    def _thin(self, kind: str) -> None:
        seen, kept = 0, []
        for each in self._lines:
            seen += each.kind == kind
            if each.kind != kind or seen % 2 or seen == self._counts[kind]:
                kept.append(each)
        self._lines = kept
        self._counts[kind] = sum(each.kind == kind for each in kept)
