"""The distance from a polygon in its plane, from which solids of one outline have theirs."""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array


def signed_distance(x: Array, y: Array, corners: Array) -> Array:
    """Measure distances from the outline of a polygon.

    Args:
        x: (...) m.
        y: (...) m.
        corners: (K, 2) m, in order around it, either way.

    Returns:
        (...) m, negative inside.
    """
    square = np.full(np.shape(x), np.inf)
    inside = np.zeros(np.shape(x), dtype=bool)
    for (from_x, from_y), (to_x, to_y) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along_x, along_y = to_x - from_x, to_y - from_y
        off_x, off_y = x - from_x, y - from_y
        share = np.clip((off_x * along_x + off_y * along_y) / (along_x**2 + along_y**2), 0.0, 1.0)
        square = np.minimum(square, (off_x - share * along_x) ** 2 + (off_y - share * along_y) ** 2)
        crosses = (from_y > y) != (to_y > y)  # a ray towards +x, counted by parity
        inside ^= crosses & ((off_x * along_y < off_y * along_x) == (along_y > 0))
    return np.where(inside, -1.0, 1.0) * np.sqrt(square)


def prism_distance(flat: Array, axial: Array) -> Array:
    """Put together what lies within an outline and between two planes.

    Args:
        flat: (...) m, signed distance from the outline in its plane.
        axial: (...) m, from the nearer of the planes, negative between them.

    Returns:
        (...) m, signed distance from the solid.
    """
    outside = np.hypot(np.maximum(flat, 0.0), np.maximum(axial, 0.0))
    return outside + np.minimum(np.maximum(flat, axial), 0.0)
