"""The voxels about a link: those that it sweeps, and what they lose by it.

Shapes: N particles, L links, P patches, B bodies, (X, Y, Z) voxels, V = X·Y·Z. Metres, world frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part
from haptic_env.patches import row_at
from observer.maps.capsules import any_of, owner, ringing
from observer.maps.contact_model import LIMIT


class CapsuleVoxels(NamedTuple):
    """Room for the voxels about one link.

    Attributes:
        cell: index in the flat map.
        along: m, height of its centre along the bone.
        square: m², its distance from the bone, squared.
        lost: quanta of log-odds.
    """

    cell: NDArray[np.int64]
    along: Array
    square: Array
    lost: NDArray[np.int64]


@part()
def capsule_voxels(lattice, at, axis, length, reach, found):
    """Find the voxels whose centres lie less than some way from a bone.

    Args:
        lattice: the grid.
        at: three numbers, m, where the bone begins.
        axis: three numbers, along which it lies.
        length: m, of the bone.
        reach: m.
        found: is filled but for `lost`; it has `room`.

    Returns:
        How many there are.
    """
    res, origin = lattice.resolution, triple(lattice.origin)
    ny, nz = lattice.shape[1], lattice.shape[2]
    low0, high0 = _voxel_range(at[0], axis[0] * length, reach, origin[0], res, lattice.shape[0])
    low1, high1 = _voxel_range(at[1], axis[1] * length, reach, origin[1], res, ny)
    low2, high2 = _voxel_range(at[2], axis[2] * length, reach, origin[2], res, nz)
    outer, first, count = reach * reach, (origin[2] - at[2]) / res + 0.5, 0
    for i in range(low0, high0):
        dx = origin[0] + (i + 0.5) * res - at[0]
        for j in range(low1, high1):
            dy = origin[1] + (j + 0.5) * res - at[1]
            begin, end = _voxel_span(dx, dy, axis, outer, first, res, low2, high2)
            # Beyond the ends of the bone a row leaves the capsule before it leaves the cylinder.
            while begin < end and _from_bone(dx, dy, origin[2] + (begin + 0.5) * res - at[2], axis, length)[1] >= outer:
                begin += 1
            while begin < end and _from_bone(dx, dy, origin[2] + (end - 0.5) * res - at[2], axis, length)[1] >= outer:
                end -= 1
            if begin >= end:
                continue
            row, shift = (i * ny + j) * nz, count - begin
            for k in range(begin, end):  # nothing but arithmetic, several voxels at a time
                z, square = _from_bone(dx, dy, origin[2] + (k + 0.5) * res - at[2], axis, length)
                found.cell[shift + k], found.along[shift + k], found.square[shift + k] = row + k, z, square
            count += end - begin
    return count


@part()
def _voxel_range(start, along, pad, origin, res, count):
    """Voxels along one axis that a capsule from `start` to `start + along` may fill, padded."""
    low = int(np.floor((min(start, start + along) - pad - origin) / res))
    high = int(np.floor((max(start, start + along) + pad - origin) / res)) + 1
    return max(low, 0), min(high, count)


@part()
def _voxel_span(dx, dy, axis, outer, first, res, low, high):
    """Of the voxels `low` to `high` of a row, whose first centre lies `first` voxels from the origin, find some.

    Returns:
        The first within √`outer` m of the line through it along `axis`, and the one after the last.
    """
    across = 1.0 - axis[2] * axis[2]
    if across < 1e-9:
        return low, high
    s = axis[0] * dx + axis[1] * dy
    inside = (s * axis[2]) ** 2 - across * (dx * dx + dy * dy - s * s - outer)
    if inside <= 0.0:
        return low, low
    half, per_voxel = np.sqrt(inside), 1.0 / (across * res)
    begin = int(np.floor((s * axis[2] - half) * per_voxel - first))
    end = int(np.ceil((s * axis[2] + half) * per_voxel - first)) + 1
    return max(begin, low), min(end, high)


@part()
def _from_bone(dx, dy, dz, axis, length):
    """Of a point, from the start of a bone of `length` m along `axis` (3,).

    Returns:
        Its height along it, m, and the square of its distance from it, m².
    """
    z = axis[0] * dx + axis[1] * dy + axis[2] * dz
    along = min(max(z, 0.0), length)
    return z, dx * dx + dy * dy + dz * dz - 2.0 * z * along + along * along


@part()
def triple(vector):
    """Take a vector's numbers by themselves, so that loops over voxels need not read them anew.

    Args:
        vector: (3,).

    Returns:
        Three numbers.
    """
    return vector[0], vector[1], vector[2]


@part()
def from_point(lattice, cell, at):
    """Find the way to the centre of a voxel.

    Args:
        lattice: the grid.
        cell: index of the voxel in the flat map.
        at: (3,) m, from where.

    Returns:
        x, y and z, m.
    """
    res, origin, ny, nz = lattice.resolution, lattice.origin, lattice.shape[1], lattice.shape[2]
    i, j, k = cell // (ny * nz), cell // nz % ny, cell % nz
    return (
        origin[0] + (i + 0.5) * res - at[0],
        origin[1] + (j + 0.5) * res - at[1],
        origin[2] + (k + 0.5) * res - at[2],
    )


@part()
def most_voxels(body, lattice, link, reach):
    """Bound the number of voxels whose centres lie less than some way from a bone.

    Args:
        body: the hand.
        lattice: the grid.
        link: index of the link with the bone.
        reach: m.

    Returns:
        More than that, not whole.
    """
    radius = reach + lattice.resolution
    volume = np.pi * radius**2 * (body.layout.length[link] + 4.0 / 3.0 * radius)
    return min(volume / lattice.resolution**3, float(lattice.shape[0] * lattice.shape[1] * lattice.shape[2]))


@kernel()
def room(felt, margin):
    """Make room for the voxels about any one link.

    Args:
        felt: what a step says (`observer.maps.capsules.MapInput`).
        margin: m, beyond where a touched cell may lie.

    Returns:
        The `CapsuleVoxels`.
    """
    most, reach = 0.0, felt.reach
    for link in range(len(felt.body.radius)):
        near = max(felt.body.radius[link] + felt.evidence.near, reach.carved[link])
        most = max(most, most_voxels(felt.body, felt.lattice, link, max(near, reach.felt[link] + margin)))
    count = int(most) + 1
    return CapsuleVoxels(
        np.empty(count, dtype=np.int64), np.empty(count), np.empty(count), np.empty(count, dtype=np.int64)
    )


@inner()
def sweep(felt, frames, rings, maps, least, found):
    """Free the cells inside a hand, as `sweep_free` does.

    Args:
        felt: of the step.
        frames: where the bodies are, with `position` (B, 3) and `rotation` (B, 3, 3).
        rings: as of `ringing`.
        maps: the `ParticleMaps`.
        least: quanta of log-odds, below which no cell falls that particles have in common.
        found: scratch, of `room`.
    """
    body, lattice, evidence, reach = felt.body, felt.lattice, felt.evidence, felt.reach
    common, slot, seen, stale = maps.common, maps.slot, maps.seen, maps.stale
    for link in range(len(rings)):
        if reach.felt[link] < 0.0:
            continue
        at, turn = triple(frames.position[felt.tree.link_body[link]]), frames.rotation[felt.tree.link_body[link]]
        radius = body.radius[link]
        close, touched = radius + evidence.near, any_of(rings[link])
        near, carved = close * close, reach.carved[link] ** 2
        core, outer = max(radius - evidence.deep, 0.0) ** 2, reach.felt[link] ** 2
        per_bin, kept = 1.0 / reach.bin[link], 0
        axis, pad = triple(turn[:, 2]), max(close, reach.carved[link])
        for v in range(capsule_voxels(lattice, at, axis, body.layout.length[link], pad, found)):
            cell, square = found.cell[v], found.square[v]
            if square < near and not seen[cell]:
                seen[cell] = stale[cell] = True
            if square >= carved or common[cell] == least:
                continue
            if touched and core <= square < outer and rings[link, row_at(body.layout, link, found.along[v])]:
                patch = owner(body, link, turn, from_point(lattice, cell, at))
                if patch >= 0 and felt.contacts[patch]:
                    continue
            lost = reach.free[link, int(max(square, 0.0) * per_bin)]
            seen[cell] = stale[cell] = True
            if slot[cell] < 0:
                common[cell] = max(common[cell] - lost, least)
            else:
                found.cell[kept], found.lost[kept] = slot[cell], lost
                kept += 1
        for n in range(len(maps.own)):
            for w in range(kept):
                maps.own[n, found.cell[w]] = max(maps.own[n, found.cell[w]] - found.lost[w], -LIMIT)


@kernel()
def sweep_free(felt, stance, maps):
    """Free the cells inside a link, the surer the deeper (`LinkEvidence.free`), but for those about the skin of a patch
    that feels contact: they lose log-odds, down to -LIMIT, in all maps.

    Seen is then what lies within `Evidence.near` of the skin, and stale all that changes.

    Args:
        felt: of the step.
        stance: at the mean pose.
        maps: the `ParticleMaps`.
    """
    sweep(felt, stance, ringing(felt.body, felt.contacts), maps, -LIMIT, room(felt, 0.0))
