"""How far the skin of a link is from a hypothetical solid, as far as its likelihood asks.

Shapes: H hypotheses, L links, B beads, M points of the skin, P patches. Lengths in metres.

A link that feels nothing asks for the gap of its nearest point alone. Points of a bead are looked up from the far side
of the one that was nearest to the last hypothesis: what is known there excludes most of the others, for distance
changes no faster than its place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from haptic_env.arrays import Array
from haptic_env.compiled import kernel, part
from observer.shape.distance_fields import VAGUEST, Index, box_of, field_distance, in_field, std_at

SLACK = 0.0002  # m: between the nodes of a field distance may change a little faster than its place


class GapScratch(NamedTuple):
    """What is kept from hypothesis to hypothesis.

    Attributes:
        gaps: (P,) m.
        beads: (B,) m, of those of a link.
        far: (B,) the point of each bead that lies across from the nearest one.
        stds: (P,) m, how surely the surface is known to which the gaps are.
    """

    gaps: Array
    beads: Array
    far: Index
    stds: Array


@kernel()
def scratch_of(skin, patches):
    """Make room.

    Args:
        skin: of the hand.
        patches: P.

    Returns:
        The `GapScratch`.
    """
    far = np.empty(len(skin.along), dtype=np.int64)
    for bead in range(len(far)):
        far[bead] = skin.begin[bead]
    return GapScratch(np.empty(patches), np.empty(len(far)), far, np.empty(patches))


@part(fastmath=True)
def _axis_of(solids, h, skin, link, frame):
    """Lay the axis of a link into the field of a hypothesis.

    Args:
        solids: the distance fields.
        h: index of the hypothesis.
        skin: of the hand.
        link: index.
        frame: of the link, position (3,) m and rotation (3, 3).

    Returns:
        Where the axis begins and the way along it, each three numbers in the frame of the field, and the gap of the
        ball about the whole link, m.
    """
    position, rotation = frame
    nodes, box, resolution, far = solids.nodes, box_of(solids, solids.drawn_in[h]), solids.resolution, solids.far
    scale, at, turn = solids.scale[h], solids.position[h], solids.rotation[h]
    p0, p1, p2 = in_field(turn, scale, position[0] - at[0], position[1] - at[1], position[2] - at[2])
    c0, c1, c2 = in_field(turn, scale, rotation[0, 2], rotation[1, 2], rotation[2, 2])
    s = skin.middle[link]
    gap = scale * field_distance(nodes, box, resolution, far, p0 + c0 * s, p1 + c1 * s, p2 + c2 * s)
    return (p0, p1, p2), (c0, c1, c2), gap - skin.ball[link]


@part(fastmath=True)
def patch_gaps(solids, h, skin, link, frame, clear, gaps):
    """Find how far the patches of a link are from a hypothesis.

    Distance changes no faster than its place: what a look-up shows to be clear is skipped.

    Args:
        solids: the distance fields.
        h: index of the hypothesis.
        skin: of the hand.
        link: index.
        frame: of the link, position (3,) m and rotation (3, 3).
        clear: m, beyond which no distance counts.
        gaps: (P,) m, filled for the patches of the link if any is less than `clear`, with `clear` where it is not.

    Returns:
        How far the flesh about the bone is from the hypothesis, m, or `clear` where it is farther: negative where it
        would have to be inside, as where a thin wall cuts through it that no patch lies in.
    """
    _, rotation = frame
    nodes, box, resolution, far = solids.nodes, box_of(solids, solids.drawn_in[h]), solids.resolution, solids.far
    scale, turn = solids.scale[h], solids.rotation[h]
    (p0, p1, p2), (c0, c1, c2), gap = _axis_of(solids, h, skin, link, frame)
    if gap >= clear:
        return clear
    a0, a1, a2 = in_field(turn, scale, rotation[0, 0], rotation[1, 0], rotation[2, 0])
    b0, b1, b2 = in_field(turn, scale, rotation[0, 1], rotation[1, 1], rotation[2, 1])
    for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
        gaps[patch] = clear
    flesh = clear
    bead, last = skin.first_bead[link], skin.first_bead[link + 1]
    while bead < last:
        s, radius = skin.along[bead], skin.radius[bead]
        gap = scale * field_distance(nodes, box, resolution, far, p0 + c0 * s, p1 + c1 * s, p2 + c2 * s)
        upto = s + gap - radius - clear
        if upto >= s:
            bead += 1
            while bead < last and skin.along[bead] < upto and skin.radius[bead] <= radius:
                bead += 1
            continue
        flesh = min(flesh, gap - radius)
        k, end = skin.begin[bead], skin.begin[bead + 1]
        while k < end:
            x, y, z = skin.points[k, 0], skin.points[k, 1], skin.points[k, 2]
            u, v, w = p0 + a0 * x + b0 * y + c0 * z, p1 + a1 * x + b1 * y + c1 * z, p2 + a2 * x + b2 * y + c2 * z
            gap = scale * field_distance(nodes, box, resolution, far, u, v, w)
            gaps[skin.patch[k]] = min(gaps[skin.patch[k]], gap)
            upto = skin.travel[k] + gap - clear
            k += 1
            while k < end and skin.travel[k] < upto:
                k += 1
        bead += 1
    return flesh


@part(fastmath=True)
def felt_gaps(solids, h, skin, link, frame, felt, clear, scratch):
    """Find how far a link is from a hypothesis where it feels contact, and where it feels none.

    Args:
        solids: the distance fields.
        h: index of the hypothesis.
        skin: of the hand.
        link: index.
        frame: of the link, position (3,) m and rotation (3, 3).
        felt: contacts (P,), and how many of the link's there are; patches of which nothing is known (`UNKNOWN`) are no
            part of the skin.
        clear: m, beyond which no distance counts.
        scratch: the `GapScratch`, whose `gaps` are filled for the patches of the link that feel contact.

    Returns:
        As `patch_gaps` does, how far the flesh about the bone is; and how far the nearest point of the skin that feels
        none is, m; `clear` where they are farther. Where the first is `clear` nothing is filled.
    """
    contacts, touches = felt
    gaps, beads, far_point, _ = scratch
    _, rotation = frame
    nodes, box, resolution, far = solids.nodes, box_of(solids, solids.drawn_in[h]), solids.resolution, solids.far
    scale, turn = solids.scale[h], solids.rotation[h]
    (p0, p1, p2), (c0, c1, c2), gap = _axis_of(solids, h, skin, link, frame)
    if gap >= clear:
        return clear, clear
    first, end = skin.first_bead[link], skin.first_bead[link + 1]
    flesh = clear
    for bead in range(first, end):
        s = skin.along[bead]
        gap = scale * field_distance(nodes, box, resolution, far, p0 + c0 * s, p1 + c1 * s, p2 + c2 * s)
        beads[bead] = gap - skin.radius[bead]
        flesh = min(flesh, beads[bead])
    if flesh >= clear:
        return clear, clear
    a0, a1, a2 = in_field(turn, scale, rotation[0, 0], rotation[1, 0], rotation[2, 0])
    b0, b1, b2 = in_field(turn, scale, rotation[0, 1], rotation[1, 1], rotation[2, 1])
    if touches > 0:
        for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
            gaps[patch] = clear
    silent = clear
    while True:
        # The bead that may be nearest of those left; where any gap counts, all that may be near enough.
        least, bead = clear if touches > 0 else silent + SLACK, -1
        for other in range(first, end):
            if beads[other] < least:
                least, bead = beads[other], other
        if bead < 0:
            return flesh, silent
        beads[bead] = np.inf
        k = far_point[bead]
        told, number = skin.row[k], skin.begin[bead + 1] - skin.begin[bead]
        x, y, z = skin.points[k, 0], skin.points[k, 1], skin.points[k, 2]
        u, v, w = p0 + a0 * x + b0 * y + c0 * z, p1 + a1 * x + b1 * y + c1 * z, p2 + a2 * x + b2 * y + c2 * z
        beyond = scale * field_distance(nodes, box, resolution, far, u, v, w)
        least, nearest = beyond, k
        told_of = contacts[skin.patch[k]]
        if touches > 0 and told_of > 0:
            gaps[skin.patch[k]] = min(gaps[skin.patch[k]], beyond)
        elif told_of >= 0:
            silent = min(silent, beyond)
        for n in range(told, told + number - 1):
            reach = beyond - skin.apart[n] - SLACK  # no point from here on is nearer
            if reach >= (clear if touches > 0 else silent):
                break
            k = skin.across[n]
            told_of = contacts[skin.patch[k]]
            if told_of < 0:
                continue
            rings = touches > 0 and told_of > 0
            if touches > 0 and reach >= (gaps[skin.patch[k]] if rings else silent):
                continue
            x, y, z = skin.points[k, 0], skin.points[k, 1], skin.points[k, 2]
            u, v, w = p0 + a0 * x + b0 * y + c0 * z, p1 + a1 * x + b1 * y + c1 * z, p2 + a2 * x + b2 * y + c2 * z
            gap = scale * field_distance(nodes, box, resolution, far, u, v, w)
            if gap < least:
                least, nearest = gap, k
            if rings:
                gaps[skin.patch[k]] = min(gaps[skin.patch[k]], gap)
            else:
                silent = min(silent, gap)
        far_point[bead] = skin.across[skin.row[nearest]]


@part(fastmath=True)
def uncertain_gaps(solids, h, skin, link, frame, contacts, near, scratch):
    """Find how far a link is from a hypothesis whose surface is known with an SD, where it feels contact, and where it
    feels none: in SDs of both the link's place and the surface's.

    Args:
        solids: the distance fields.
        h: index of the hypothesis.
        skin: of the hand.
        link: index.
        frame: of the link, position (3,) m and rotation (3, 3).
        contacts: (P,) 1, 0 or, of patches of which nothing is known, below 0.
        near: SD of the link's place, m, and how many SDs beyond which no gap counts.
        scratch: the `GapScratch`, whose `gaps`, in SDs, and `stds` are filled for the patches of the link.

    Returns:
        The gap of the nearest point of the skin that feels none, in SDs, `clear` where it is farther; and the SD of the
        surface there, m.
    """
    gaps, stds, (tolerance, clear) = scratch.gaps, scratch.stds, near
    _, rotation = frame
    f = solids.drawn_in[h]
    nodes, box, resolution, far = solids.nodes, box_of(solids, f), solids.resolution, solids.far
    scale, turn = solids.scale[h], solids.rotation[h]
    for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
        gaps[patch], stds[patch] = clear, 0.0
    reach = clear * math.sqrt(tolerance * tolerance + VAGUEST * VAGUEST)
    silent, vague = clear, 0.0
    (p0, p1, p2), (c0, c1, c2), gap = _axis_of(solids, h, skin, link, frame)
    if gap >= reach:
        return silent, vague
    a0, a1, a2 = in_field(turn, scale, rotation[0, 0], rotation[1, 0], rotation[2, 0])
    b0, b1, b2 = in_field(turn, scale, rotation[0, 1], rotation[1, 1], rotation[2, 1])
    for bead in range(skin.first_bead[link], skin.first_bead[link + 1]):
        s = skin.along[bead]
        gap = scale * field_distance(nodes, box, resolution, far, p0 + c0 * s, p1 + c1 * s, p2 + c2 * s)
        if gap - skin.radius[bead] >= reach:
            continue
        for k in range(skin.begin[bead], skin.begin[bead + 1]):
            told_of = contacts[skin.patch[k]]
            if told_of < 0:
                continue
            x, y, z = skin.points[k, 0], skin.points[k, 1], skin.points[k, 2]
            u, v, w = p0 + a0 * x + b0 * y + c0 * z, p1 + a1 * x + b1 * y + c1 * z, p2 + a2 * x + b2 * y + c2 * z
            gap = scale * field_distance(nodes, box, resolution, far, u, v, w)
            if gap >= reach:
                continue
            std = min(scale * std_at(solids, f, u, v, w), VAGUEST)
            ratio = gap / math.sqrt(tolerance * tolerance + std * std)
            if told_of > 0:
                if ratio < gaps[skin.patch[k]]:
                    gaps[skin.patch[k]], stds[skin.patch[k]] = ratio, std
            elif ratio < silent:
                silent, vague = ratio, std
    return silent, vague
