"""How small functions are compiled that are called often."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba import types

# Numbers as a user may give them: strided, read-only, or at any address.
GIVEN = types.Array(types.float64, 1, "A", readonly=True, aligned=False)


def inner(*signature: Any, **options: Any) -> Callable[[Callable], Callable]:
    """Compile a function that makes no arrays: without counting who refers to those it reads, each of which is an
    atomic operation. Called by kernels, in the shape posterior that took as long as its arithmetic; called from Python,
    it is half of what the call costs."""
    options |= {"cache": True, "_nrt": False}  # the latter of numba's own libraries, which its types do not list
    return numba.njit(*signature, **options)
