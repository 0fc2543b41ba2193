"""Whether samples come as often as there are steps, or as their stream has said."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

WINDOW = 5.0  # s, over which samples are counted
SHARE = 0.7  # of the rate: where so few come, there are steps of which nothing is measured


class Rates:
    """How often samples come: where that is too seldom, it is told once of each stream."""

    def __init__(self, streams: Mapping[str, str], expected: Mapping[str, float]) -> None:
        """Begin before the first.

        Args:
            streams: the name of each kind's stream.
            expected: Hz, of each kind.
        """
        self._streams, self._expected = streams, dict(expected)
        self._begun: dict[str, tuple[int, float]] = {}

    def told(self, come: Mapping[str, tuple[int, float]], silent: Collection[str]) -> Iterator[str]:
        """Tell which come too seldom.

        Args:
            come: how many of each kind have come, and the time of the newest, s: not when it arrived, since samples may
                come in bursts.
            silent: kinds of which none come at present.

        Yields:
            A line for each.
        """
        for kind in [*self._expected]:
            count, newest = come[kind]
            if kind in silent or not count:
                self._begun.pop(kind, None)
                continue
            before, begun = self._begun.setdefault(kind, come[kind])
            if newest - begun >= WINDOW:
                self._begun[kind] = come[kind]
                rate, expected = (count - before) / (newest - begun), self._expected[kind]
                if rate < SHARE * expected:
                    del self._expected[kind]
                    yield (
                        f"samples of {kind} come from {self._streams[kind]} {rate:.3g} times a second, not "
                        f"{expected:.3g}: of the steps between, they are not measured; --control-hz "
                        f"{max(1, round(rate))} fits"
                    )
