"""Hypothetical solids as distance fields, and the skin as points in balls, so that a gap costs a few look-ups.

Shapes: H hypotheses, F fields, L links, B beads, M points of the skin, P patches. Lengths in metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, part
from haptic_env.grid import VOXELS, Grid
from haptic_env.shapes.base import Shape, Solid, rotation_matrix

Index = NDArray[np.int64]
FIELD_RESOLUTION = 0.0025
AT_ONCE = 2**16  # nodes of a field
KEPT, LARGEST_KEPT = 16, 2**20  # fields and nodes of each: the next trial of a sweep has the shapes of the last
NODES = int(np.cbrt(VOXELS) + 0.5)  # at most, along each axis of a field


class Solids(NamedTuple):
    """Hypothetical solids.

    Attributes:
        field: (F, X, X, X) m, signed distance of each distinct shape in its own frame.
        resolution: m from node to node.
        half: m, the first node is at minus that.
        far: m, from whatever lies beyond the nodes at least.
        drawn_in: (H,) which field each hypothesis has.
        scale: (H,) times as large as it.
        rotation: (H, 3, 3).
        position: (H, 3) m.
    """

    field: NDArray[np.float32]
    resolution: float
    half: float
    far: float
    drawn_in: Index
    scale: Array
    rotation: Array
    position: Array


def farthest(hypotheses: Sequence[Solid]) -> float:
    """Tell how far tables may reach.

    Args:
        hypotheses: what there would be tables of.

    Returns:
        The largest `far` m for which `solids_of` has some; negative where there are none.
    """
    drawn, _, scale = _shared(hypotheses)
    return min(scale) * (0.5 * (NODES * FIELD_RESOLUTION - max(max(solid.size) for solid in drawn)) - FIELD_RESOLUTION)


def _shared(hypotheses: Sequence[Solid]) -> tuple[list[Solid], list[int], list[float]]:
    """The solids for which fields are drawn; of each of `hypotheses`, which one it has and times as large as which."""
    index: dict[tuple, int] = {}
    drawn: list[Solid] = []
    drawn_in: list[int] = []
    scale: list[float] = []
    for solid in hypotheses:
        key = (solid.name, tuple(np.round(np.array(solid.size) / solid.size[0], 6)))
        if key not in index:
            index[key] = len(drawn)
            drawn.append(solid)
        drawn_in.append(index[key])
        scale.append(solid.size[0] / drawn[index[key]].size[0])
    return drawn, drawn_in, scale


def solids_of(hypotheses: Sequence[Solid], far: float) -> Solids:
    """Make the tables of solids; those that differ in scale and pose alone share one field, drawn at the first one's
    size.

    Args:
        hypotheses: H solids.
        far: m, the distance beyond which they need not be told apart.

    Returns:
        The tables.
    """
    drawn, drawn_in, scale = _shared(hypotheses)
    reach = far / min(scale)
    extent = max(max(solid.size) for solid in drawn) + 2 * (reach + FIELD_RESOLUTION)
    grid = _grid(extent)
    field = _field if math.prod(grid.shape) <= LARGEST_KEPT else _field.__wrapped__
    return Solids(
        np.stack([field(solid.shape, solid.size, extent) for solid in drawn]),
        FIELD_RESOLUTION,
        -float(grid.origin[0] + 0.5 * FIELD_RESOLUTION),
        reach,
        np.array(drawn_in),
        np.array(scale),
        np.stack([rotation_matrix(solid.quaternion) for solid in hypotheses]),
        np.array([solid.position for solid in hypotheses], dtype=np.float64),
    )


def _grid(extent: float) -> Grid:
    return Grid.around(np.zeros(3), np.full(3, extent), FIELD_RESOLUTION)


@lru_cache(maxsize=KEPT)
def _field(shape: Shape, size: tuple[float, float, float], extent: float) -> NDArray[np.float32]:
    """Signed distance (X, Y, Z) m at the centres of `_grid`, slab by slab: a shape's own arrays stay small."""
    grid = _grid(extent)
    x, y, z = (low + (np.arange(n) + 0.5) * grid.resolution for low, n in zip(grid.origin, grid.shape, strict=True))
    result = np.empty(grid.shape, dtype=np.float32)
    thick = max(1, AT_ONCE // (len(y) * len(z)))
    for first in range(0, len(x), thick):
        slab = slice(first, first + thick)
        points = np.stack(np.meshgrid(x[slab], y, z, indexing="ij"), axis=-1)
        result[slab] = shape.signed_distance(points, np.array(size))
    result.flags.writeable = False  # whoever asks next has the same one
    return result


@part(fastmath=True)
def field_distance(field, resolution, half, far, x, y, z):
    """Look up the signed distance at a point of the field's frame, between its nodes linearly.

    Args:
        field: (X, X, X) m.
        resolution: m.
        half: m.
        far: m.
        x: m.
        y: m.
        z: m.

    Returns:
        The distance, m; `far` outside.
    """
    last = field.shape[0] - 1
    u, v, w = (x + half) / resolution, (y + half) / resolution, (z + half) / resolution
    if u < 0.0 or v < 0.0 or w < 0.0 or u >= last or v >= last or w >= last:
        return far
    i, j, k = int(u), int(v), int(w)
    u, v, w = u - i, v - j, w - k
    a = field[i, j, k] + (field[i, j, k + 1] - field[i, j, k]) * w
    b = field[i, j + 1, k] + (field[i, j + 1, k + 1] - field[i, j + 1, k]) * w
    c = field[i + 1, j, k] + (field[i + 1, j, k + 1] - field[i + 1, j, k]) * w
    d = field[i + 1, j + 1, k] + (field[i + 1, j + 1, k + 1] - field[i + 1, j + 1, k]) * w
    a += (b - a) * v
    c += (d - c) * v
    return a + (c - a) * u


@part(fastmath=True)
def in_field(turn, scale, x, y, z):
    """Turn a vector of the world into the frame of a field.

    Args:
        turn: (3, 3) rotation of the field.
        scale: times as large as which it is.
        x: m.
        y: m.
        z: m.

    Returns:
        Three numbers, m.
    """
    return (
        (turn[0, 0] * x + turn[1, 0] * y + turn[2, 0] * z) / scale,
        (turn[0, 1] * x + turn[1, 1] * y + turn[2, 1] * z) / scale,
        (turn[0, 2] * x + turn[1, 2] * y + turn[2, 2] * z) / scale,
    )


@inner()
def distance_from(solids, h, x, y, z):
    """Tell the signed distance of a point of the world from a hypothesis.

    Args:
        solids: the tables.
        h: index of the hypothesis.
        x: m.
        y: m.
        z: m.

    Returns:
        The distance, m.
    """
    at, scale = solids.position[h], solids.scale[h]
    u, v, w = in_field(solids.rotation[h], scale, x - at[0], y - at[1], z - at[2])
    field = solids.field[solids.drawn_in[h]]
    return scale * field_distance(field, solids.resolution, solids.half, solids.far, u, v, w)


@inner()
def way_out(solids, h, x, y, z, step, normal):
    """Find the direction in which the distance of a point from a hypothesis grows, by differences.

    Args:
        solids: the tables.
        h: index of the hypothesis.
        x: m.
        y: m.
        z: m.
        step: m either way.
        normal: (3,), filled; zeros where it does not grow.
    """
    normal[0] = distance_from(solids, h, x + step, y, z) - distance_from(solids, h, x - step, y, z)
    normal[1] = distance_from(solids, h, x, y + step, z) - distance_from(solids, h, x, y - step, z)
    normal[2] = distance_from(solids, h, x, y, z + step) - distance_from(solids, h, x, y, z - step)
    length = max(math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2), 1e-12)
    for i in range(3):
        normal[i] /= length
