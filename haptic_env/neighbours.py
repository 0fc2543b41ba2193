"""Which patches lie side by side on the skin of a link.

Shapes: P patches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.patches import Patches


def neighbours(patches: Patches) -> NDArray[np.bool_]:
    """Find the patches that share an edge: along the bone, around it, and with the cap of a fingertip.

    Args:
        patches: of a hand; those of different links are no neighbours.

    Returns:
        (P, P) whether two are, symmetric; no patch is its own neighbour.
    """
    along, around, rings = patches.along, patches.around, patches.rings
    patch_of = patches.layout.patch
    # What nothing feels is counted as one patch more, and left out.
    beside = np.zeros((len(patches) + 1, len(patches) + 1), dtype=bool)
    for first, link in zip(patches.layout.cell, patches.links, strict=True):
        rows = patch_of[first : first + along * around].reshape(along, around)
        if link.tip:
            cap = first + along * around
            tip = patch_of[cap + 1 : cap + 1 + (rings - 1) * around].reshape(rings - 1, around)
            rows = np.concatenate([rows, tip[::-1]])  # the rings are counted from the cap on
            beside[rows[-1], patch_of[cap]] = True
        beside[rows[:-1], rows[1:]] = True
        beside[rows, np.roll(rows, 1, axis=1)] = True
    np.fill_diagonal(beside, False)
    return (beside | beside.T)[:-1, :-1]
