"""How large a solid is of which only the proportions are said."""

from __future__ import annotations

import numpy as np

from haptic_env import validate
from haptic_env.arrays import Array

USUAL = 0.05  # metres: the geometric mean of the extents, whatever they are to each other
LONGEST = 5.0  # times as long as the mean extent: above it, nobody could hold both ends


def extents_of(what: str, *ratio: float) -> tuple[float, float, float]:
    """Give a solid its usual volume.

    Args:
        what: has these proportions, for messages.
        ratio: three extents, in any unit.

    Returns:
        The extents, m; their product is that of a cube of 50 mm.

    Raises:
        ValueError: where one is not above 0, or they are too unlike to be held.
    """
    given = np.array([validate.number(f"{what}'s extent", each, above=0.0) for each in ratio])
    extents = USUAL * given / np.exp(np.log(given).mean())
    if extents.max() > LONGEST * USUAL or extents.min() < USUAL / LONGEST:
        raise ValueError(
            f"{what}'s proportions must keep each extent within {LONGEST:g} times the mean, got {list(ratio)}"
        )
    x, y, z = extents.tolist()
    return x, y, z


def check_kept(what: str, extents: Array, usual: Array) -> None:
    """Check that a size keeps the proportions of a solid that has no others.

    Args:
        what: is scaled, for messages.
        extents: (3,) m, the size.
        usual: (3,) extents of the solid, in any unit.

    Raises:
        ValueError: where it does not.
    """
    ratio = extents / usual
    if np.ptp(ratio) > 1e-6 * ratio[0]:
        valid = (ratio[0] * usual).round(6).tolist()
        raise ValueError(f"{what} is only scaled as a whole, e.g. to {valid} m, got {extents.tolist()}")
