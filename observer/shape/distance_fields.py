"""Hypothetical solids as distance fields, and the skin as points in balls, so that a gap costs a few look-ups.

Shapes: H hypotheses, F fields, L links, B beads, M points of the skin, P patches. Lengths in metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, part
from haptic_env.grid import VOXELS
from haptic_env.shapes.base import Solid, rotation_matrix
from observer.shape.drawn_fields import FIELD_RESOLUTION, fields_of, spread_of

Index = NDArray[np.int64]
VAGUEST = 0.010  # m, SD of a surface that is known no better: it may be anywhere about
NODES = int(np.cbrt(VOXELS) + 0.5)  # at most, along each axis of a field


class Solids(NamedTuple):
    """Hypothetical solids.

    Attributes:
        nodes: (T,) m, signed distances of all distinct shapes, one field after the other.
        first: (F,) where the field of each begins.
        spread: (F,) where the SDs (m) of each begin, of the surface nearest to its nodes; below 0: it has none.
        shape: (F, 3) nodes of it along each axis of its own frame.
        low: (F, 3) m, its first node.
        exact: (F,) whether it is the distance from a surface everywhere (`Shape.exact`).
        resolution: m from node to node.
        far: m, from whatever lies beyond the nodes at least.
        drawn_in: (H,) which field each hypothesis has.
        scale: (H,) times as large as it.
        rotation: (H, 3, 3).
        position: (H, 3) m.
    """

    nodes: NDArray[np.float32]
    first: Index
    spread: Index
    shape: Index
    low: Array
    exact: NDArray[np.bool_]
    resolution: float
    far: float
    drawn_in: Index
    scale: Array
    rotation: Array
    position: Array

    def field(self, f: int) -> NDArray[np.float32]:
        """Give the signed distances of one field.

        Args:
            f: which.

        Returns:
            (X, Y, Z) m.
        """
        shape = self.shape[f]
        return self.nodes[self.first[f] : self.first[f] + shape.prod()].reshape(shape)

    def of(self, hypotheses: Index) -> Solids:
        """Choose some of the hypotheses.

        Args:
            hypotheses: (M,) which.

        Returns:
            Those, with the same fields.
        """
        return self._replace(
            drawn_in=self.drawn_in[hypotheses],
            scale=self.scale[hypotheses],
            rotation=self.rotation[hypotheses],
            position=self.position[hypotheses],
        )

    def and_of(self, others: Solids) -> Solids:
        """Add hypotheses.

        Args:
            others: of the same fields.

        Returns:
            These and then those.
        """
        return self._replace(
            drawn_in=np.concatenate([self.drawn_in, others.drawn_in]),
            scale=np.concatenate([self.scale, others.scale]),
            rotation=np.concatenate([self.rotation, others.rotation]),
            position=np.concatenate([self.position, others.position]),
        )


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
    fields = fields_of(drawn, reach)
    count = np.array([grid.shape for grid, _ in fields])
    end = np.cumsum(count.prod(axis=1))
    spreads = {f: spread_of(solid, grid) for f, (solid, (grid, _)) in enumerate(zip(drawn, fields, strict=True))}
    known = {f: each.ravel() for f, each in spreads.items() if each is not None}
    spread = np.full(len(drawn), -1)
    spread[[*known]] = end[-1] + np.concatenate([[0], np.cumsum([len(each) for each in known.values()])])[:-1]
    return Solids(
        np.concatenate([*(distance.ravel() for _, distance in fields), *known.values()]),
        np.concatenate([[0], end[:-1]]),
        spread,
        count,
        np.array([np.asarray(grid.origin) + 0.5 * grid.resolution for grid, _ in fields]),
        np.array([solid.shape.exact for solid in drawn]),
        FIELD_RESOLUTION,
        reach,
        np.array(drawn_in),
        np.array(scale),
        np.stack([rotation_matrix(solid.quaternion) for solid in hypotheses]),
        np.array([solid.position for solid in hypotheses], dtype=np.float64),
    )


@part()
def box_of(solids, f):
    """Find where a field lies.

    Args:
        solids: the tables.
        f: index of the field.

    Returns:
        Its first node's index in `nodes`, its nodes along each axis, and where the first is, three numbers m.
    """
    shape, low = solids.shape[f], solids.low[f]
    return solids.first[f], shape[0], shape[1], shape[2], low[0], low[1], low[2]


@part(fastmath=True)
def field_distance(nodes, box, resolution, far, x, y, z):
    """Look up the signed distance at a point of the field's frame, between its nodes linearly.

    Args:
        nodes: (T,) m.
        box: of the field.
        resolution: m.
        far: m.
        x: m.
        y: m.
        z: m.

    Returns:
        The distance, m; `far` outside.
    """
    first, count_x, count_y, count_z, low_x, low_y, low_z = box
    u, v, w = (x - low_x) / resolution, (y - low_y) / resolution, (z - low_z) / resolution
    if u < 0.0 or v < 0.0 or w < 0.0 or u >= count_x - 1 or v >= count_y - 1 or w >= count_z - 1:
        return far
    i, j, k = int(u), int(v), int(w)
    u, v, w = u - i, v - j, w - k
    across = count_y * count_z
    # Without a sign: else each index would be asked whether it counts from the end.
    n, one = np.uint64(first + i * across + j * count_z + k), np.uint64(1)
    row, plane = np.uint64(count_z), np.uint64(across)
    a = nodes[n] + (nodes[n + one] - nodes[n]) * w
    n += row
    b = nodes[n] + (nodes[n + one] - nodes[n]) * w
    n += plane
    d = nodes[n] + (nodes[n + one] - nodes[n]) * w
    n -= row
    c = nodes[n] + (nodes[n + one] - nodes[n]) * w
    a += (b - a) * v
    c += (d - c) * v
    return a + (c - a) * u


@part(fastmath=True)
def std_at(solids, f, x, y, z):
    """Look up how surely the surface is known that is nearest to a point of a field's frame.

    Args:
        solids: the tables.
        f: index of the field, of one that has SDs.
        x: m.
        y: m.
        z: m.

    Returns:
        The SD, m; 0 outside.
    """
    _, count_x, count_y, count_z, low_x, low_y, low_z = box_of(solids, f)
    box = solids.spread[f], count_x, count_y, count_z, low_x, low_y, low_z
    return field_distance(solids.nodes, box, solids.resolution, 0.0, x, y, z)


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
    box = box_of(solids, solids.drawn_in[h])
    return scale * field_distance(solids.nodes, box, solids.resolution, solids.far, u, v, w)


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
