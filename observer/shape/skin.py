"""The skin of a hand as points in balls, so that a gap costs a few look-ups.

Shapes: L links, B beads, M points of the skin, P patches. Lengths in metres.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.shape.distance_fields import Index

SKIN_SPACING = 0.006


class Skin(NamedTuple):
    """The skin in balls within balls: a ball about each link, and beads, the points about one spot of a bone.

    Attributes:
        body: (L,) of each link.
        group: (L,) finger.
        middle: (L,) m along its bone, of its ball.
        ball: (L,) m, radius of that.
        numb: (L,) whether some of it feels nothing.
        first_patch: (L + 1,) patches of link l are `first_patch[l]` up to `first_patch[l + 1]`.
        first_bead: (L + 1,) its beads likewise.
        along: (B,) m along its bone, of a bead.
        radius: (B,) m.
        begin: (B + 1,) points of bead b are `begin[b]` up to `begin[b + 1]`.
        points: (M, 3) m in their link's frame.
        patch: (M,).
        travel: (M,) m, the way from point to point up to each.
        row: (M,) where the others of its bead are told of, by each point: from `row[k]` on as many as the bead has.
        across: (Q,) those, the farthest first, itself the last.
        apart: (Q,) m, how far they are.
    """

    body: Index
    group: Index
    middle: Array
    ball: Array
    numb: NDArray[np.bool_]
    first_patch: Index
    first_bead: Index
    along: Array
    radius: Array
    begin: Index
    points: Array
    patch: Index
    travel: Array
    row: Index
    across: Index
    apart: Array


def touches_of(skin: Skin, contacts: NDArray[np.int8]) -> NDArray[np.int64]:
    """Count the patches of each link that feel contact.

    Args:
        skin: of the hand.
        contacts: (P,) 1, 0 or less where it is not known.

    Returns:
        (L,).
    """
    return np.diff(np.concatenate([[0], np.cumsum(contacts > 0)])[skin.first_patch])


def skin_of(hand: Hand) -> Skin:
    """Put points on the skin of a hand, at most `SKIN_SPACING` apart.

    Args:
        hand: with L links.

    Returns:
        The points in their balls.
    """
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
    each, ball = np.arange(len(length) + 1), np.zeros(len(length))  # a link that feels nothing has no ball
    np.maximum.at(ball, link, from_middle)
    begin = np.append(starts, len(points)).astype(np.int64)
    return Skin(
        body=hand.link_bodies.astype(np.int64),
        group=hand.link_group.astype(np.int64),
        middle=0.5 * length,
        ball=ball,
        numb=hand.patches.numb,
        first_patch=np.searchsorted(hand.patches.link, each).astype(np.int64),
        first_bead=np.searchsorted(link[starts], each).astype(np.int64),
        along=along,
        radius=np.maximum.reduceat(from_foot, starts),
        begin=begin,
        points=np.ascontiguousarray(points),
        patch=skin.patch[order].astype(np.int64),
        travel=np.cumsum(np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)),
        **_others(points, begin),
    )


def _others(points: Array, begin: Index) -> dict[str, Any]:
    """`row`, `across` and `apart` of a `Skin` whose bead b has the `points` (M, 3) from `begin[b]` on."""
    row, across, apart = np.zeros(len(points), dtype=np.int64), [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
    told = 0
    for first, end in itertools.pairwise(begin):
        between = np.linalg.norm(points[first:end, None] - points[None, first:end], axis=2)
        order = np.argsort(-between, axis=1, kind="stable")
        across.append((first + order).ravel())
        apart.append(np.take_along_axis(between, order, axis=1).ravel())
        row[first:end] = told + (end - first) * np.arange(end - first)
        told += (end - first) ** 2
    return {"row": row, "across": np.concatenate(across).astype(np.int64), "apart": np.concatenate(apart)}
