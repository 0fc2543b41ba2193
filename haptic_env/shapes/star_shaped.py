"""Solids whose whole surface is seen from one point, from its distance in every direction.

The surface is drawn as triangles, finely enough that no point of it is more than 0.03 mm off on an object of 50 mm
(where it is smooth); what is inside is told by the distance itself.
"""

from __future__ import annotations

import hashlib
from abc import abstractmethod
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, cKDTree

from haptic_env.arrays import Array
from haptic_env.composer import mjcf
from haptic_env.shapes.base import Shape
from haptic_env.shapes.nearest_triangle import nearest_distance
from haptic_env.shapes.sphere_points import directions

FINE, COARSE = 12_000, 1_500  # directions in which the truth and the physics know the surface
CHUNK = 2**14  # points at once
CONES = 96  # convex pieces of one that is not convex

Index = NDArray[np.int64]


class StarShaped(Shape):
    """Any extents: the solid is stretched to them."""

    convex = True

    @abstractmethod
    def radius(self, directions: Array) -> Array:
        """Tell how far the surface is from the pole.

        Args:
            directions: (M, 3) unit vectors from the pole.

        Returns:
            (M,) in any unit, above 0.
        """

    @cached_property
    def _box(self) -> tuple[Array, Array]:
        """Middle (3,) and extents (3,) of the bounding box about the pole, in the unit of `radius`."""
        rays = directions(FINE)
        surface = self.radius(rays)[:, None] * rays
        low, high = surface.min(axis=0), surface.max(axis=0)
        return (low + high) / 2, high - low

    @cached_property
    def content(self) -> str:
        return f"star {hashlib.sha256(self.radius(directions(COARSE)).tobytes()).hexdigest()}"

    def surface(self, count: int, size: Array) -> tuple[Array, Index]:
        """Draw the surface.

        Args:
            count: of corners.
            size: (3,) m, full extents.

        Returns:
            Corners (count, 3) m in the shape's frame, and triangles (F, 3).
        """
        rays, faces = triangulated(count)
        middle, extents = self._box
        return (self.radius(rays)[:, None] * rays - middle) * (size / extents), faces

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        there = np.asarray(points, dtype=np.float64)
        flat = there.reshape(-1, 3)
        corners, around, tree = _tree(self, tuple(np.asarray(size).tolist()))
        parts = [flat[first : first + CHUNK] for first in range(0, len(flat), CHUNK)]
        distance = [nearest_distance(part, corners, around[tree.query(part)[1]]) for part in parts]
        signed = np.concatenate([*distance, np.empty(0)]) * np.where(self._inside(flat, np.asarray(size)), -1.0, 1.0)
        return signed.reshape(there.shape[:-1])

    def _inside(self, points: Array, size: Array) -> NDArray[np.bool_]:
        middle, extents = self._box
        from_pole = points * (extents / size) + middle
        far = np.linalg.norm(from_pole, axis=1)
        rays = from_pole / np.maximum(far, 1e-300)[:, None]
        rays[far == 0] = [0.0, 0.0, 1.0]
        return far < self.radius(rays)

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        corners, faces = self.surface(COARSE, size)
        if self.convex:
            pieces = [corners]
        else:  # cones from the pole, each as good as convex
            middle, extents = self._box
            pole = -middle * (size / extents)
            which = cKDTree(directions(CONES)).query(directions(COARSE)[faces].mean(axis=1))[1]
            pieces = [np.vstack([pole, corners[np.unique(faces[which == cone])]]) for cone in range(CONES)]
        return [
            {"type": "mesh", "mesh": root.asset.add("mesh", name=f"piece{number}", vertex=np.ravel(piece))}
            for number, piece in enumerate(pieces)
        ]


@lru_cache(maxsize=4)
def triangulated(count: int) -> tuple[Array, Index]:
    """Cover a sphere with triangles.

    Args:
        count: of corners.

    Returns:
        Unit vectors (count, 3) spread evenly, and the triangles (F, 3) between neighbours.
    """
    rays = directions(count)
    return rays, ConvexHull(rays).simplices.astype(np.int64)


@lru_cache(maxsize=16)
def _tree(shape: StarShaped, size: tuple[float, float, float]) -> tuple[Array, NDArray[np.int64], cKDTree]:
    """Corners (V, 3), the triangles (V, K, 3) about each, the last repeated, and a tree of the corners."""
    corners, faces = shape.surface(FINE, np.array(size))
    owner = faces.ravel()
    order = np.argsort(owner, kind="stable")
    run = np.bincount(owner, minlength=len(corners))
    start = np.cumsum(run) - run
    which = start[:, None] + np.minimum(np.arange(run.max()), run[:, None] - 1)
    return corners, faces[order[which] // 3], cKDTree(corners)
