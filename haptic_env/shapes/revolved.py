"""Solids of revolution about z, from the polygon that a plane through the axis cuts out of them."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env.composer import mjcf
from haptic_env.shapes import polygon
from haptic_env.shapes.base import Shape

AROUND = 96  # corners of a circle as the physics has it: 0.03 mm inside one of 50 mm


class Revolved(Shape):
    """Convex and round about z: size is (diameter, diameter, height)."""

    @abstractmethod
    def cross_section(self) -> NDArray[np.float64]:
        """Outline the solid as a plane through its axis cuts it.

        Returns:
            (K, 2) corners (across, along z), symmetric about the axis, in a square of width 1 about 0.
        """

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        extents = super().check_size(size)
        if not np.isclose(extents[0], extents[1]):
            kind = type(self).__name__.lower()
            raise ValueError(f"a {kind}'s size is (diameter, diameter, height) in metres, got {extents.tolist()}")
        return extents

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        outline = self.cross_section() * [size[0], size[2]]
        return polygon.signed_distance(np.hypot(points[..., 0], points[..., 1]), points[..., 2], outline)

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        turn = np.linspace(0.0, 2 * np.pi, AROUND, endpoint=False)
        right = self.cross_section() * [size[0], size[2]]
        right = right[right[:, 0] >= 0]
        rings = [
            np.stack([out * np.cos(turn), out * np.sin(turn), np.full(AROUND, up)], axis=1)
            if out > 0
            else np.array([[0.0, 0.0, up]])
            for out, up in right
        ]
        mesh = root.asset.add("mesh", name="revolved", vertex=np.ravel(np.concatenate(rings)))
        return [{"type": "mesh", "mesh": mesh}]
