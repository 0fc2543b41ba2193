"""Points on and in one link, a capsule, in its frame: z along the bone, palmar -x. Shapes: M points. Metres."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haptic_env.arrays import Array

if TYPE_CHECKING:
    from haptic_env.patches import Link


def on_skin(link: Link, along: int, around: int, rings: int, spacing: float) -> tuple[Array, Array]:
    """Spread points over the skin of a link, as many in each of its cells as in others of their kind.

    Args:
        link: with skin on its side and its distal cap.
        along: rows of cells along its bone.
        around: sectors of cells around it.
        rings: of cells, of its cap.
        spacing: m, at most from one to the next.

    Returns:
        Points (M, 3) m and normals (M, 3), outward.
    """
    rows = _multiple(along, link.length / spacing)
    sectors = _multiple(around, 2 * np.pi * link.radius / spacing)
    height = (np.arange(rows) + 0.5) / rows * link.length
    side = np.tile(_ring(sectors, around), (rows, 1))
    points = [link.radius * side + np.repeat(height, sectors)[:, None] * [0, 0, 1]]
    normals = [side]
    bands = _multiple(rings, 0.5 * np.pi * link.radius / spacing)
    for band in range(bands):
        polar = (band + 0.5) / bands * np.pi / 2
        number = max(around if link.tip and rings > 1 else 1, int(np.ceil(sectors * np.sin(polar))))
        cap = _ring(number, around) * np.sin(polar)
        cap[:, 2] = np.cos(polar)
        points.append(link.radius * cap + [0, 0, link.length])
        normals.append(cap)
    return np.concatenate(points), np.concatenate(normals)


def within(link: Link, spacing: float, depth: float) -> tuple[Array, Array]:
    """Fill a link with points on a cubic lattice.

    Args:
        link: with both its caps.
        spacing: m, of the lattice.
        depth: m, at least beneath the skin.

    Returns:
        Points (M, 3) m, and directions (M, 3) from the bone outwards, zero on the bone.
    """
    reach = np.arange(0.0, link.radius, spacing)
    across = np.concatenate([-reach[:0:-1], reach])
    rise = np.arange(-link.radius, link.length + link.radius, spacing) + 0.5 * spacing
    lattice = np.stack(np.meshgrid(across, across, rise, indexing="ij"), axis=-1).reshape(-1, 3)
    bone = np.clip(lattice[:, 2], 0.0, link.length)[:, None] * [0, 0, 1]
    radial = lattice - bone
    distance = np.linalg.norm(radial, axis=1)
    inside = distance < link.radius - depth
    return lattice[inside], radial[inside] / np.maximum(distance[inside, None], 1e-12)


def _multiple(count: int, least: float) -> int:
    """The smallest multiple of `count` that is not below `least`, nor 0."""
    return int(np.ceil(max(count, int(np.ceil(least))) / count)) * count


def _ring(number: int, around: int) -> Array:
    """(number, 3) directions about the bone, the first at the edge of the palmar one of `around` sectors."""
    turn = (np.arange(number) + 0.5) / number * 2 * np.pi + np.pi - np.pi / around
    return np.stack([np.cos(turn), np.sin(turn), np.zeros(number)], axis=1)
