"""How functions are compiled. What was compiled is kept on disk (`haptic_env.kernel_cache`).

`kernel` is for what Python calls, `inner` and `part` for what only kernels call. None holds Python's lock while it
runs, so that threads may run the same kernel side by side (`observer.threads`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba import types
from numba.core.dispatcher import Dispatcher

from haptic_env.kernel_cache import KernelCache

# Numbers as a user may give them: strided, read-only, or at any address.
GIVEN = types.Array(types.float64, 1, "A", readonly=True, aligned=False)
KERNELS: list[Dispatcher] = []  # all that there are so far
# What is not said here a function would take from whichever caller happened to have it compiled first, so that the same
# code would round differently from process to process.
OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "fastmath": False,
    "forceinline": False,
    "_nrt": True,
    "nogil": True,
    "no_cfunc_wrapper": True,
}


def kernel(*signature: Any, **options: Any) -> Callable[[Callable], Callable]:
    """Compile a function when it is first called; dividing by zero is no error.

    Args:
        *signature: types of the arguments; the function is compiled now and for them alone, and any argument is cast to
            them.
        **options: as `numba.njit`'s.

    Returns:
        The decorator.
    """

    def compile(function: Callable) -> Callable:
        dispatcher = numba.njit(**OPTIONS | options)(function)
        dispatcher._cache = KernelCache(dispatcher)
        KERNELS.append(dispatcher)
        for each in signature:
            dispatcher.compile(each)
        if signature:
            dispatcher.disable_compile()
        return dispatcher

    return compile


def inner(*signature: Any, **options: Any) -> Callable[[Callable], Callable]:
    """Compile a function that makes no arrays, without counting who refers to those it reads.

    Each count is an atomic operation: called by kernels, in the shape posterior that took as long as its arithmetic;
    called from Python, it is half of what the call costs.

    Args:
        *signature: as `kernel`'s.
        **options: as `kernel`'s.

    Returns:
        The decorator.
    """
    return kernel(*signature, _nrt=False, **options)  # an option of numba's own libraries


def part(**options: Any) -> Callable[[Callable], Callable]:
    """Compile a small function of which every caller has a copy of its own, as if it stood there.

    Args:
        **options: as `kernel`'s.

    Returns:
        The decorator.
    """
    return inner(forceinline=True, **options)
