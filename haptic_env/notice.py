"""What takes long, and is done once on a machine: whoever shows it is told how far it is, else a line is logged."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[str, int, int], None]

LOG = logging.getLogger("haptic_slam")
_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def heard_by(listener: Listener) -> Iterator[None]:
    """Be told, in this context and thread, what takes long.

    Args:
        listener: called with what is done, how much of it is, and how much there is.

    Yields:
        Nothing; within, nothing is logged.
    """
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def tell(what: str, done: int, total: int) -> None:
    """Say how far something is that takes long.

    Args:
        what: is done, in words.
        done: how much of it is.
        total: how much there is.
    """
    listener = _listener.get()
    if listener is not None:
        listener(what, done, total)
    elif done == 0:
        LOG.warning("%s: %d", what, total)
