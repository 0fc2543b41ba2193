"""A pyramid on a rectangular base, apex at +z."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.composer import mjcf
from haptic_env.shapes.base import Shape


class Pyramid(Shape):
    """All upright pyramids: size is (base along x, base along y, height)."""

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        # Both mirror planes fold the solid onto x, y >= 0: two slanted faces and the base are left.
        x, y, z = np.abs(points[..., 0]), np.abs(points[..., 1]), points[..., 2] + size[2] / 2
        half_x, half_y, height = size[0] / 2, size[1] / 2, size[2]
        plane_x = (x * height + (z - height) * half_x) / np.hypot(height, half_x)
        plane_y = (y * height + (z - height) * half_y) / np.hypot(height, half_y)
        inner = np.maximum(np.maximum(plane_x, plane_y), -z)
        base = np.sqrt(np.maximum(x - half_x, 0) ** 2 + np.maximum(y - half_y, 0) ** 2 + z**2)
        corner = np.array([half_x, half_y, 0.0])
        folded = np.stack([x, y, z], axis=-1)
        apex = np.array([0.0, 0.0, height])
        side_x = _distance_to_triangle(folded, apex, corner, corner * [1, -1, 1])
        side_y = _distance_to_triangle(folded, apex, corner, corner * [-1, 1, 1])
        outer = np.minimum(base, np.minimum(side_x, side_y))
        return np.where(inner > 0, outer, -outer)

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        x, y, z = size / 2
        corners = [[sx * x, sy * y, -z] for sx in (-1, 1) for sy in (-1, 1)]
        mesh = root.asset.add("mesh", name="pyramid", vertex=np.ravel([*corners, [0, 0, z]]))
        return [{"type": "mesh", "mesh": mesh}]


def _distance_to_triangle(
    points: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance (...,) of `points` (..., 3) to the triangle with corners `a`, `b`, `c` (3,)."""
    normal = np.cross(b - a, c - a)
    normal = normal / np.linalg.norm(normal)
    within = np.ones(points.shape[:-1], dtype=bool)
    nearest = np.full(points.shape[:-1], np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        offset = points - start
        within &= offset @ np.cross(normal, edge) >= 0
        along = np.clip(offset @ edge / (edge @ edge), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(offset - along[..., None] * edge, axis=-1))
    return np.where(within, np.abs((points - a) @ normal), nearest)
