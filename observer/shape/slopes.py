"""How far a point is from a hypothetical solid, and in which way that grows: the slope of what is looked up, exactly.

Lengths in metres.
"""

from __future__ import annotations

import math

import numpy as np

from haptic_env.compiled import part
from observer.shape.distance_fields import VAGUEST, field_distance, in_field, std_at


@part(fastmath=True)
def gap_from(solids, h, box, x, y, z):
    """Tell the signed distance of a point of the world from a hypothesis.

    Args:
        solids: the tables.
        h: index of the hypothesis.
        box: of its field.
        x: m.
        y: m.
        z: m.

    Returns:
        The distance, m.
    """
    at, turn, scale = solids.position[h], solids.rotation[h], solids.scale[h]
    u, v, w = in_field(turn, scale, x - at[0], y - at[1], z - at[2])
    return scale * field_distance(solids.nodes, box, solids.resolution, solids.far, u, v, w)


@part()
def loosened(solids, h, tolerance, x, y, z):
    """Tell how surely the gap between a point of the world and a hypothesis is known.

    Args:
        solids: the tables.
        h: index of the hypothesis.
        tolerance: m, SD of the point's place.
        x: m.
        y: m.
        z: m.

    Returns:
        The SD, m: of both its place and the surface's.
    """
    f = solids.drawn_in[h]
    if solids.spread[f] < 0:
        return tolerance
    at, scale = solids.position[h], solids.scale[h]
    u, v, w = in_field(solids.rotation[h], scale, x - at[0], y - at[1], z - at[2])
    std = min(scale * std_at(solids, f, u, v, w), VAGUEST)
    return math.sqrt(tolerance * tolerance + std * std)


@part(fastmath=True)
def way_from(solids, h, box, x, y, z):
    """Find the direction in which the distance of a point of the world from a hypothesis grows.

    Args:
        solids: the tables.
        h: index of the hypothesis.
        box: of its field.
        x: m.
        y: m.
        z: m.

    Returns:
        Three numbers whose squares add up to 1; of a point beyond the tables the way from the hypothesis's middle.
    """
    at, turn, scale = solids.position[h], solids.rotation[h], solids.scale[h]
    dx, dy, dz = x - at[0], y - at[1], z - at[2]
    u, v, w = in_field(turn, scale, dx, dy, dz)
    gap, a, b, c = _field_slope(solids.nodes, box, solids.resolution, solids.far, u, v, w)
    if gap < solids.far:
        dx = turn[0, 0] * a + turn[0, 1] * b + turn[0, 2] * c
        dy = turn[1, 0] * a + turn[1, 1] * b + turn[1, 2] * c
        dz = turn[2, 0] * a + turn[2, 1] * b + turn[2, 2] * c
    long = max(math.sqrt(dx * dx + dy * dy + dz * dz), 1e-12)
    return dx / long, dy / long, dz / long


@part(fastmath=True)
def _field_slope(nodes, box, resolution, far, x, y, z):
    """Look up the signed distance at a point as `field_distance` does, and how it changes there.

    Args:
        nodes: (T,) m.
        box: of the field.
        resolution: m.
        far: m.
        x: m.
        y: m.
        z: m.

    Returns:
        The distance, m, and its derivative by the point, three numbers; `far` and zeros outside.
    """
    first, count_x, count_y, count_z, low_x, low_y, low_z = box
    u, v, w = (x - low_x) / resolution, (y - low_y) / resolution, (z - low_z) / resolution
    if u < 0.0 or v < 0.0 or w < 0.0 or u >= count_x - 1 or v >= count_y - 1 or w >= count_z - 1:
        return far, 0.0, 0.0, 0.0
    i, j, k = int(u), int(v), int(w)
    u, v, w = u - i, v - j, w - k
    across = count_y * count_z
    n, one = np.uint64(first + i * across + j * count_z + k), np.uint64(1)
    row, plane = np.uint64(count_z), np.uint64(across)
    a, da = nodes[n] * (1.0 - w) + nodes[n + one] * w, nodes[n + one] - nodes[n]
    n += row
    b, db = nodes[n] * (1.0 - w) + nodes[n + one] * w, nodes[n + one] - nodes[n]
    n += plane
    d, dd = nodes[n] * (1.0 - w) + nodes[n + one] * w, nodes[n + one] - nodes[n]
    n -= row
    c, dc = nodes[n] * (1.0 - w) + nodes[n + one] * w, nodes[n + one] - nodes[n]
    near, beyond = a + (b - a) * v, c + (d - c) * v
    along_z = (da + (db - da) * v) * (1.0 - u) + (dc + (dd - dc) * v) * u
    along_y = (b - a) * (1.0 - u) + (d - c) * u
    return near + (beyond - near) * u, (beyond - near) / resolution, along_y / resolution, along_z / resolution
