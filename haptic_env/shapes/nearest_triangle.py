"""The distance of points from the nearest of a few triangles each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array


def nearest_distance(points: Array, corners: Array, faces: NDArray[np.int64]) -> Array:
    """Measure how far each point is from the nearest of its own few triangles.

    Args:
        points: (M, 3) m.
        corners: (V, 3) m.
        faces: (M, K, 3) the triangles of each point.

    Returns:
        (M,) m.

    References:
        Ericson 2005, Real-Time Collision Detection, section 5.1.5 (barycentric regions).
    """
    a, b, c = (corners[faces[..., corner]] for corner in range(3))
    ab, ac, ap = b - a, c - a, points[:, None] - a
    d00, d01, d11 = (ab * ab).sum(-1), (ab * ac).sum(-1), (ac * ac).sum(-1)
    d20, d21 = (ap * ab).sum(-1), (ap * ac).sum(-1)
    area = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v, w = (d11 * d20 - d01 * d21) / area, (d00 * d21 - d01 * d20) / area
    flat = ((ap - v[..., None] * ab - w[..., None] * ac) ** 2).sum(-1)
    rim = np.minimum(np.minimum(_square(ap, ab), _square(ap, ac)), _square(points[:, None] - b, c - b))
    within = (v >= 0) & (w >= 0) & (v + w <= 1)
    return np.sqrt(np.where(within, flat, rim).min(axis=1))


def _square(offset: Array, edge: Array) -> Array:
    """Square of the distance (...) from edges (..., 3), of points `offset` from where they begin."""
    along = np.clip((offset * edge).sum(-1) / np.maximum((edge * edge).sum(-1), 1e-300), 0.0, 1.0)
    return ((offset - along[..., None] * edge) ** 2).sum(-1)
