"""Hypothetical solids as distance fields, and the skin as points in balls, so that a gap costs a few look-ups.

Shapes: H hypotheses, F fields, L links, B beads, M points of the skin, P patches. Lengths in metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import part
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.shapes.base import Solid, rotation_matrix

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FIELD_RESOLUTION = 0.0025
SKIN_SPACING = 0.006


class Skin(NamedTuple):
    """The skin in balls within balls. Each link (L,): its `body` and finger `group`, a ball about `middle` on its bone
    of radius `ball`, its patches from `first_patch[l]` and its beads from `first_bead[l]` to `[l + 1]`. A bead (B,) is
    the points about one spot of the bone, `along` it, of `radius`; its points go from `begin[b]` to `begin[b + 1]`.
    `points` (M, 3) in their link's frame, `patch` (M,), and `travel` (M,), the way from point to point up to each.
    """

    body: Index
    group: Index
    middle: Array
    ball: Array
    first_patch: Index
    first_bead: Index
    along: Array
    radius: Array
    begin: Index
    points: Array
    patch: Index
    travel: Array


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


def skin_of(hand: Hand) -> Skin:
    """The skin of `hand`, points at most `SKIN_SPACING` apart."""
    skin = hand.patches.surface(SKIN_SPACING)
    length = np.array([link.length for link in hand.links])
    foot = np.round(skin.points[:, 2].clip(0.0, length[skin.link]), 9)
    turn = np.arctan2(skin.points[:, 1], skin.points[:, 0])
    order = np.lexsort((turn, skin.points[:, 2], foot, skin.link))
    points, link, foot = skin.points[order], skin.link[order], foot[order]
    starts = np.flatnonzero((np.diff(link, prepend=-1) != 0) | (np.diff(foot, prepend=-1.0) != 0))
    count = np.diff(starts, append=len(points))
    along = foot[starts]
    from_foot = np.linalg.norm(points - np.repeat(along, count)[:, None] * [0, 0, 1], axis=1)
    from_middle = np.linalg.norm(points - 0.5 * length[link, None] * [0, 0, 1], axis=1)
    each = np.arange(len(length) + 1)
    return Skin(
        body=hand.link_bodies.astype(np.int64),
        group=hand.link_group.astype(np.int64),
        middle=0.5 * length,
        ball=np.maximum.reduceat(from_middle, np.searchsorted(link, each[:-1])),
        first_patch=np.searchsorted(hand.patches.link, each).astype(np.int64),
        first_bead=np.searchsorted(link[starts], each).astype(np.int64),
        along=along,
        radius=np.maximum.reduceat(from_foot, starts),
        begin=np.append(starts, len(points)).astype(np.int64),
        points=np.ascontiguousarray(points),
        patch=skin.patch[order].astype(np.int64),
        travel=np.cumsum(np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)),
    )


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
