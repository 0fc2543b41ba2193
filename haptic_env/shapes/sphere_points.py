"""Points spread evenly over a sphere."""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array


def directions(count: int) -> Array:
    """Spread directions evenly: a golden spiral.

    Args:
        count: of them.

    Returns:
        (count, 3) unit vectors.

    References:
        Swinbank & Purser 2006, Q. J. R. Meteorol. Soc. 132, 1769-1793.
    """
    number = np.arange(count) + 0.5
    up = 1 - 2 * number / count
    turn = np.pi * (1 + 5**0.5) * number
    out = np.sqrt(1 - up**2)
    return np.stack([out * np.cos(turn), out * np.sin(turn), up], axis=1)
