"""The skin of a hand as points in balls, so that a gap costs a few look-ups.

Shapes: L links, B beads, M points of the skin, P patches. Lengths in metres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.shape.distance_fields import Index

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
