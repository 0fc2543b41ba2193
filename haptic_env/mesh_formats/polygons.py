"""Faces of any number of corners, and the triangles that they are. V corners, F faces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env import extras

MOST = 500_000  # triangles: what is checked in seconds
CORNERS = 10_000  # of one face
FLAT = 0.01  # of the largest extent: how far a corner may lie from the plane of its face
LEVEL = 1e-9  # of a polygon's area: less is none


class Refused(ValueError):
    """What a file holds can be read, and is not taken."""


class Polygons(NamedTuple):
    """What a mesh file holds.

    Attributes:
        vertices: (V, 3) in the unit of the file.
        corners: (sum of the lengths,) for face after face the vertices that it joins, from 0.
        lengths: (F,) how many corners each face has.
    """

    vertices: NDArray[np.float64]
    corners: NDArray[np.int64]
    lengths: NDArray[np.int64]


def check_count(triangles: int) -> None:
    """Check that triangles are no more than are taken.

    Args:
        triangles: how many there are.

    Raises:
        Refused: where they are more.
    """
    if triangles > MOST:
        raise Refused(f"has {triangles:,} triangles or more, at most {MOST:,} are taken: simplify it")


def check_corners(count: int) -> None:
    """Check that corners are no more than so many triangles can have.

    Args:
        count: how many there are.

    Raises:
        Refused: where they are more.
    """
    if count > 3 * MOST:
        raise Refused(f"has {count:,} corners or more, at most {3 * MOST:,} are taken: simplify it")


def triangulate(held: Polygons) -> NDArray[np.int64]:
    """Cut faces into triangles, in their order and wound as they are.

    Args:
        held: the faces.

    Returns:
        (T, 3).

    Raises:
        Refused: for a face that is not flat or crosses itself, since nobody can tell what solid it bounds.
    """
    vertices, corners, lengths = held
    if (lengths < 3).any() or (lengths > CORNERS).any():
        wrong = lengths[(lengths < 3) | (lengths > CORNERS)][0]
        raise Refused(f"has a face of {wrong:,} corners, 3 to {CORNERS:,} are taken")
    check_count(int((lengths - 2).sum()))
    if (lengths == 3).all():
        return corners.reshape(-1, 3)
    extent = float(np.ptp(vertices[corners], axis=0).max())
    first, place = np.cumsum(lengths) - lengths, np.cumsum(lengths - 2) - (lengths - 2)
    triangles = np.empty((int((lengths - 2).sum()), 3), dtype=np.int64)
    for length in np.unique(lengths):
        which = np.flatnonzero(lengths == length)
        faces = corners[first[which, None] + np.arange(length)]
        triangles[place[which, None] + np.arange(length - 2)] = _of_equal_length(vertices, faces, extent)
    return triangles


def _of_equal_length(vertices: NDArray[np.float64], faces: NDArray[np.int64], extent: float) -> NDArray[np.int64]:
    """(M, K - 2, 3) triangles of `faces` (M, K): a fan where they are convex."""
    length = faces.shape[1]
    steps = np.arange(1, length - 1)
    fan = np.stack([np.zeros_like(steps), steps, steps + 1], axis=-1)
    if length == 4:
        fan = np.array([[0, 1, 2], [2, 3, 0]])
    triangles = faces[:, fan]
    if length == 3:
        return triangles
    points = vertices[faces] - vertices[faces].mean(axis=1, keepdims=True)
    edges = np.roll(points, -1, axis=1) - points
    area = 0.5 * np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)  # Newell: (M, 3), along the normal
    reach = np.abs(points).max(axis=(1, 2))
    size = np.linalg.norm(area, axis=-1)
    thin = size <= LEVEL * reach**2
    normal = area / np.where(thin, 1.0, size)[:, None]
    uneven = np.abs((points * normal[:, None]).sum(axis=-1)).max(axis=1)
    if (~thin & (uneven > FLAT * extent)).any():
        worst = int(np.argmax(np.where(thin, 0.0, uneven)))
        raise Refused(
            f"has a face of {length} corners that is not flat: one lies {uneven[worst] / extent:.2g} of the object's "
            "width off its plane; triangulate it"
        )
    following = np.roll(edges, -1, axis=1)
    turn = (np.cross(edges, following) * normal[:, None]).sum(axis=-1)
    angle = np.arctan2(turn, (edges * following).sum(axis=-1))
    convex = (turn > LEVEL * size[:, None]).all(axis=1) & (angle.sum(axis=1) < 3 * np.pi)  # once round, no star
    for index in np.flatnonzero(~convex):
        if thin[index]:
            if np.linalg.svd(points[index], compute_uv=False)[1] > FLAT * extent * length:
                raise Refused(f"has a face of {length} corners that crosses itself: triangulate it")
            continue  # a line: any triangles of it cancel
        triangles[index] = faces[index][_ears(points[index], normal[index], size[index], angle[index])]
    return triangles


def _ears(points: NDArray[np.float64], normal: NDArray[np.float64], area: float, angle: NDArray[np.float64]) -> NDArray:
    """(K - 2, 3) triangles of a polygon `points` (K, 3) of that `area`; `angle` (K,) rad: its turns at the corners."""
    manifold = extras.load("manifold3d", "meshes", "a face of more than three corners")
    across = np.linalg.svd(normal[None])[2][1:]
    across[1] *= np.sign(np.cross(across[0], across[1]) @ normal)
    flat = np.ascontiguousarray(points @ across.T)
    triangles = np.asarray(manifold.triangulate([flat]))
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    once = abs(angle.sum() - 2 * np.pi) < 1.0
    if len(triangles) != len(points) - 2 or not once or (areas < -1e-6 * area).any():
        raise Refused(f"has a face of {len(points)} corners that crosses itself: triangulate it")
    return triangles
