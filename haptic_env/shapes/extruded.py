"""Solids with one outline from bottom to top."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from haptic_env.shapes import polygon
from haptic_env.shapes.base import Shape


class Extruded(Shape):
    """Upright, any outline: size is (along x, along y, height)."""

    @abstractmethod
    def outline(self) -> NDArray[np.float64]:
        """Outline the solid seen from above.

        Returns:
            (K, 2) corners in order, in a square of width 1 about 0.
        """

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        flat = polygon.signed_distance(points[..., 0], points[..., 1], self.outline() * size[:2])
        return polygon.prism_distance(flat, np.abs(points[..., 2]) - size[2] / 2)
