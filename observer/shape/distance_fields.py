"""Hypothetical solids as distance fields, and the skin as points in balls, so that a gap costs a few look-ups.

Shapes: H hypotheses, F fields, L links, B beads, M points of the skin, P patches. Lengths in metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import part
from haptic_env.grid import Grid
from haptic_env.shapes.base import Solid, rotation_matrix

Index = NDArray[np.int64]
FIELD_RESOLUTION = 0.0025


class Solids(NamedTuple):
    """Signed distance `field` (F, X, X, X) m of each distinct shape in its own frame, its nodes `resolution` apart, the
    first at `-half`; whatever lies beyond is at least `far` away. For each hypothesis (H,): which field it has, its
    `scale`, and its pose, `rotation` (H, 3, 3) and `position` (H, 3) m."""

    field: NDArray[np.float32]
    resolution: float
    half: float
    far: float
    drawn_in: Index
    scale: Array
    rotation: Array
    position: Array


def solids_of(hypotheses: Sequence[Solid], far: float) -> Solids:
    """The tables of `hypotheses`; `far` m: the distance beyond which they need not be told apart.

    Solids that differ in scale and pose alone share one field, drawn at the first one's size.
    """
    index: dict[tuple, int] = {}
    drawn: list[Solid] = []
    drawn_in, scale = [], []
    for solid in hypotheses:
        key = (solid.name, tuple(np.round(np.array(solid.size) / solid.size[0], 6)))
        if key not in index:
            index[key] = len(drawn)
            drawn.append(solid)
        drawn_in.append(index[key])
        scale.append(solid.size[0] / drawn[index[key]].size[0])
    reach = far / min(scale)
    extent = max(max(solid.size) for solid in drawn) + 2 * (reach + FIELD_RESOLUTION)
    grid = Grid.around(np.zeros(3), np.full(3, extent), FIELD_RESOLUTION)
    return Solids(
        np.stack([s.shape.signed_distance(grid.centres(), np.array(s.size)) for s in drawn]).astype(np.float32),
        FIELD_RESOLUTION,
        -float(grid.centres()[0, 0, 0, 0]),
        reach,
        np.array(drawn_in),
        np.array(scale),
        np.stack([rotation_matrix(solid.quaternion) for solid in hypotheses]),
        np.array([solid.position for solid in hypotheses], dtype=np.float64),
    )


@part()
def field_distance(field, resolution, half, far, x, y, z):
    """Signed distance at a point of the field's frame, between its nodes linearly; `far` outside."""
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


@part()
def _gap(solids, h, x, y, z):
    at, turn, scale = solids.position[h], solids.rotation[h], solids.scale[h]
    x, y, z = (x - at[0]) / scale, (y - at[1]) / scale, (z - at[2]) / scale
    return scale * field_distance(
        solids.field[solids.drawn_in[h]],
        solids.resolution,
        solids.half,
        solids.far,
        turn[0, 0] * x + turn[1, 0] * y + turn[2, 0] * z,
        turn[0, 1] * x + turn[1, 1] * y + turn[2, 1] * z,
        turn[0, 2] * x + turn[1, 2] * y + turn[2, 2] * z,
    )
