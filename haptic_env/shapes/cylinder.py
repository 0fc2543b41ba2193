"""A round cylinder standing along z."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env.composer import mjcf
from haptic_env.shapes.base import Shape


class Cylinder(Shape):
    """All upright round cylinders: size is (diameter, diameter, height)."""

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        extents = super().check_size(size)
        if not np.isclose(extents[0], extents[1]):
            raise ValueError(f"a cylinder's size is (diameter, diameter, height) in metres, got {extents.tolist()}")
        return extents

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        radial = np.hypot(points[..., 0], points[..., 1]) - size[0] / 2
        axial = np.abs(points[..., 2]) - size[2] / 2
        outside = np.hypot(np.maximum(radial, 0.0), np.maximum(axial, 0.0))
        return outside + np.minimum(np.maximum(radial, axial), 0.0)

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        return [{"type": "cylinder", "size": [size[0] / 2, size[2] / 2]}]
