"""Who does the work of a sweep: `share`, for what many calls need, and `run`.

A worker is one core's work and runs one call at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from threadpoolctl import threadpool_limits

from observer import threads

Call = tuple[Any, ...]


class WorkersLostError(Exception):
    """Who worked is gone; the message says what may have happened."""


class Workers(Protocol):
    """Who runs the calls.

    Attributes:
        told: says it, in words.
    """

    @property
    def told(self) -> str: ...

    def share(self, value: Any) -> Any:
        """Send once what many calls need.

        Args:
            value: that they need.

        Returns:
            What stands for it among the arguments of calls.
        """

    def run(self, work: Callable[..., Any], calls: Iterable[Call]) -> Iterator[Any]:
        """Run calls.

        Args:
            work: what is called, and importable where it runs.
            calls: arguments of each call.

        Returns:
            What each call returns, in the order in which they finish. It raises what `work` raises, `WorkersLostError`,
            and `ValueError` for a worker that must not take part.
        """


def limit_threads() -> None:
    """Compute on one core, as a worker does."""
    threads.limit(1)
    threadpool_limits(1)


@contextmanager
def on_one_core() -> Iterator[None]:
    """Compute on one core, as a worker does, and afterwards on as many as before."""
    before = threads.limit(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        threads.limit(before)
