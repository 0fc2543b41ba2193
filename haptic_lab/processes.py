"""How long processes of this machine live that others have started, and whom Ctrl-C ends."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker


def end_with_parent() -> None:
    """End this process, which another one has spawned by `multiprocessing`, as soon as that is gone, though it were
    killed. Where nobody has spawned it, it does nothing. (Forked processes would keep each other alive.)"""
    parent = multiprocessing.parent_process()

    def wait() -> None:
        parent.join()  # type: ignore[union-attr]  # on a pipe whose other end only the parent holds
        os._exit(1)

    if parent is not None:
        threading.Thread(target=wait, daemon=True).start()


@contextmanager
def deaf() -> Iterator[None]:
    """Start processes that do not hear Ctrl-C, which a terminal sends to all; this process hears it after.

    Yields:
        Nothing; what is started meanwhile is deaf.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # which the first process that is spawned would start, and hear Ctrl-C after
    usual = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, usual)
