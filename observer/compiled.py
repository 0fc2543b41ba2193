"""How kernels are compiled: in parallel, and alone where threads would do harm; and what they call within."""

from __future__ import annotations

import functools
import os
import types
from collections.abc import Callable
from typing import Any

import numba

_forked = False


def _after_fork() -> None:
    global _forked
    _forked = True


os.register_at_fork(after_in_child=_after_fork)


def inner(**options: Any) -> Callable[[Callable], Callable]:
    """Compile a function that kernels call and that makes no arrays: without counting who refers to those it reads,
    each of which is an atomic operation. In the shape posterior they took as long as its arithmetic."""
    uncounted: dict[str, Any] = {"_nrt": False}  # an option of numba's own libraries, which its types do not list
    return numba.njit(cache=True, **uncounted, **options)


def parallel(**options: Any) -> Callable[[Callable], Callable]:
    """Compile a function whose `prange` runs on `numba.get_num_threads()` threads; the same bits for any number.

    With one thread, and in a forked process, whose copy of OpenMP's threads is dead and whose parent has the cores,
    it is compiled and run without.
    """

    def compile(function: Callable) -> Callable:
        threaded = numba.njit(parallel=True, **options)(function)
        # A name of its own, by which numba keeps it apart in the cache on disk.
        alone = types.FunctionType(function.__code__, function.__globals__, f"{function.__name__}_alone")
        alone.__qualname__, alone.__module__ = alone.__name__, function.__module__
        serial = numba.njit(**options)(alone)

        @functools.wraps(function)
        def run(*arguments: Any) -> Any:
            return (serial if _forked or numba.get_num_threads() == 1 else threaded)(*arguments)

        return run

    return compile
