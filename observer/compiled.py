"""How kernels are compiled: in parallel, and alone where threads would do harm."""

from __future__ import annotations

import functools
import os
import types
from collections.abc import Callable
from typing import Any

import numba

from haptic_env.compiled import inner

__all__ = ["inner", "parallel"]
_forked = False


def _after_fork() -> None:
    global _forked
    _forked = True


os.register_at_fork(after_in_child=_after_fork)


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
