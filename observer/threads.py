"""Kernels side by side on several threads.

Threads are Python's own, asleep until there is work; kernels do not hold its lock. Whatever the number of threads, each
part of the work is computed by the same machine code in one order: the same bits.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from joblib import cpu_count

from haptic_env import validate

PARTS = 4  # a thread: who shares a core with another program leaves some to the others
_most: int | None = None
_pools: dict[tuple[int, int], ThreadPoolExecutor] = {}


def limit(most: int | None) -> int | None:
    """Bound the number of threads wherever nobody says how many, in this process.

    Args:
        most: threads; None: one a core.

    Returns:
        The bound that held until now.

    Raises:
        ValueError: for what is no such number.
    """
    global _most
    before, _most = _most, None if most is None else validate.integer("threads", most, 1)
    return before


def check(threads: int | None) -> int | None:
    """Check how many threads somebody asks for.

    Args:
        threads: a number, or None.

    Returns:
        The same.

    Raises:
        ValueError: for anything else, and beyond 1024.
    """
    return None if threads is None else validate.integer("threads", threads, 1, 1024)


def chosen(threads: int | None, work: float, enough: float) -> int:
    """Choose how many threads pay.

    Args:
        threads: as many as that; None: one where there is less work than is enough for two.
        work: in any unit.
        enough: from which on two threads are faster than one, in the same unit.

    Returns:
        The number.
    """
    if threads is not None:
        return threads
    return 1 if work < enough else min(_most or cpu_count(), max(1, int(2 * work / enough)))


def run(kernel: Callable[..., None], count: int, threads: int, *arguments: Any) -> None:
    """Call a kernel over a range, side by side on several threads.

    Args:
        kernel: called with where a part of the range begins, where it ends, and the `arguments`.
        count: length of the range.
        threads: how many.
        *arguments: of the kernel.
    """
    if threads == 1 or count < 2:
        kernel(0, count, *arguments)
        return
    parts = min(count, PARTS * threads)
    turns = iter([(count * i // parts, count * (i + 1) // parts) for i in range(parts)])
    others = [_pool(threads - 1).submit(_work, kernel, turns, arguments) for _ in range(threads - 1)]
    try:
        _work(kernel, turns, arguments)
    finally:
        for other in others:
            other.result()


def _work(kernel: Callable[..., None], turns: Iterator[tuple[int, int]], arguments: tuple[Any, ...]) -> None:
    for begin, end in turns:
        kernel(begin, end, *arguments)


def _pool(threads: int) -> ThreadPoolExecutor:
    """This process's: threads do not live on in a forked one."""
    key = os.getpid(), threads
    if key not in _pools:
        _pools[key] = ThreadPoolExecutor(threads, thread_name_prefix="haptic-slam")
    return _pools[key]
