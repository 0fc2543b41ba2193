"""The skin of a hand as triangles, each of one patch.

Shapes: L links, V vertices, three a triangle.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.patches import Link

AROUND, ALONG, CAP = 20, 8, 4  # quadrilaterals around a capsule, along its bone, and on each of its caps


def skin_of(hand: Hand) -> dict[str, Any]:
    """Draw the skin.

    Args:
        hand: with L links.

    Returns:
        `places` (V, 3) m and `normals` (V, 3), in the frames of the links, `patches` (V,), -1 where nothing is felt,
        and `first`, a list (L,) of the first vertex of each link.
    """
    places, normals, patches, first = [], [], [], []
    count = 0
    for index, link in enumerate(hand.links):
        corners, outward = _capsule(link)
        middle = corners.mean(axis=1)
        on_skin = _onto(middle, link)
        patch = hand.patches.locate(np.full(len(middle), index), on_skin)
        quads = [0, 1, 2, 0, 2, 3]
        places.append(corners[:, quads].reshape(-1, 3))
        normals.append(outward[:, quads].reshape(-1, 3))
        patches.append(np.repeat(patch, 6))
        first.append(count)
        count += 6 * len(corners)
    return {
        "places": np.concatenate(places).astype(np.float32),
        "normals": np.concatenate(normals).astype(np.float32),
        "patches": np.concatenate(patches).astype(np.int16),
        "first": first,
    }


def _capsule(link: Link) -> tuple[Array, Array]:
    """Corners (F, 4, 3) m of the quadrilaterals of a link, counterclockwise from outside, and normals there."""
    polar = np.linspace(0.0, 0.5 * np.pi, CAP + 1)
    height = np.linspace(0.0, link.length, ALONG + 1)
    # Of each ring: how far from the axis and along it its normal points, and where its ball's centre is.
    low = [(np.cos(each), -np.sin(each), 0.0) for each in polar[::-1]]
    side = [(1.0, 0.0, each) for each in height[1:-1]]
    high = [(np.cos(each), np.sin(each), link.length) for each in polar]
    rings = np.array([*low, *side, *high])
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND + 1)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    normal = np.empty((len(rings), AROUND + 1, 3))
    normal[..., :2], normal[..., 2] = rings[:, None, :1] * circle, rings[:, None, 1]
    place = link.radius * normal
    place[..., 2] += rings[:, None, 2]

    def quads(each: Array) -> Array:
        return np.stack([each[:-1, :-1], each[:-1, 1:], each[1:, 1:], each[1:, :-1]], axis=2).reshape(-1, 4, 3)

    return quads(place), quads(normal)


def _onto(points: Array, link: Link) -> Array:
    """The points of the skin nearest to `points` (M, 3) m."""
    bone = np.zeros_like(points)
    bone[:, 2] = points[:, 2].clip(0.0, link.length)
    out = points - bone
    return np.asarray(bone + link.radius * out / np.linalg.norm(out, axis=1, keepdims=True))
