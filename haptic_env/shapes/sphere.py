"""A ball."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env.composer import mjcf
from haptic_env.shapes.base import Shape


class Sphere(Shape):
    """All balls; the three extents are one diameter."""

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        extents = super().check_size(size)
        if not np.allclose(extents, extents[0]):
            raise ValueError(f"a sphere's size is three equal extents in metres, got {extents.tolist()}")
        return extents

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.linalg.norm(points, axis=-1) - size[0] / 2

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        return [{"type": "sphere", "size": [size[0] / 2]}]
