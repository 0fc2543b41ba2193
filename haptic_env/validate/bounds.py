"""The check of arrays that the control loop asks for at every step, compiled."""

from __future__ import annotations

import numpy as np
from numba import types
from numpy.typing import NDArray

from haptic_env.compiled import GIVEN, inner


@inner(types.boolean(GIVEN, types.float64))
def within(numbers: NDArray[np.float64], bound: float) -> bool:
    """Tell whether none of `numbers` (M,) is beyond ± `bound`, or NaN."""
    inside = True
    for each in numbers:
        inside &= abs(each) <= bound
    return inside
