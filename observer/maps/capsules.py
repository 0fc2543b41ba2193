"""The hand, the grid and the contact model as arrays, and what compiled code asks of them.

L links, P patches, M points of the skin, (X, Y, Z) voxels, V = X·Y·Z.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import kernel, part
from haptic_env.grid import Grid
from haptic_env.patches import Patches


class Body(NamedTuple):
    """The hand as capsules with patches, in arrays: `radius`, `length`, `tip`, `first` (L,); the layout of patches;
    and M points just outside the skin, `points` (M, 3) m in their link's frame, sorted by patch: those of patch p are
    `begin[p]` up to `begin[p + 1]`; `patch_link` (P,); `core` (M, 3) m are the same points moved beneath the skin.
    """

    radius: NDArray[np.float64]
    length: NDArray[np.float64]
    tip: NDArray[np.bool_]
    first: NDArray[np.int64]
    along: int
    around: int
    rings: int
    points: NDArray[np.float64]
    core: NDArray[np.float64]
    begin: NDArray[np.int64]
    patch_link: NDArray[np.int64]


class Lattice(NamedTuple):
    """A grid in arrays: `origin` (3,) m, `resolution` m, `shape` (3,)."""

    origin: NDArray[np.float64]
    resolution: float
    shape: NDArray[np.int64]


@lru_cache(maxsize=8)
def body_of(patches: Patches, resolution: float) -> Body:
    """The arrays of a hand with these `patches`, with points of the skin about two voxels apart."""
    skin = patches.surface(2.0 * resolution)
    order = np.argsort(skin.patch, kind="stable")
    lift = 0.5 * resolution * skin.normals
    return Body(
        radius=np.array([link.radius for link in patches.links]),
        length=np.array([link.length for link in patches.links]),
        tip=np.array([link.tip for link in patches.links]),
        first=patches.first,
        along=patches.along,
        around=patches.around,
        rings=patches.rings,
        points=(skin.points + lift)[order],
        core=(skin.points - lift)[order],
        begin=np.searchsorted(skin.patch[order], np.arange(len(patches) + 1)).astype(np.int64),
        patch_link=patches.link.astype(np.int64),
    )


def lattice_of(grid: Grid) -> Lattice:
    """The arrays of `grid`."""
    return Lattice(np.array(grid.origin), grid.resolution, np.array(grid.shape))


@part()
def voxel_of(lattice, x, y, z):
    """The voxel of a point, m: its three indices, and whether `lattice` has it; as `Grid.index`."""
    res, origin, shape = lattice.resolution, lattice.origin, lattice.shape
    i = int(np.floor((x - origin[0]) / res))
    j = int(np.floor((y - origin[1]) / res))
    k = int(np.floor((z - origin[2]) / res))
    return i, j, k, 0 <= i < shape[0] and 0 <= j < shape[1] and 0 <= k < shape[2]


@part()
def triple(vector):
    """The numbers of `vector` (3,) by themselves, so that loops over voxels need not read them anew."""
    return vector[0], vector[1], vector[2]


@part()
def from_bone(dx, dy, dz, axis, length):
    """Of a point, from the start of a bone of `length` m along `axis` (3,): its height along it, m, and the square of
    its distance from it, m²."""
    z = axis[0] * dx + axis[1] * dy + axis[2] * dz
    along = min(max(z, 0.0), length)
    return z, dx * dx + dy * dy + dz * dz - 2.0 * z * along + along * along


@part()
def voxel_range(start, along, pad, origin, res, count):
    """Voxels along one axis that a capsule from `start` to `start + along` may fill, padded."""
    low = int(np.floor((min(start, start + along) - pad - origin) / res))
    high = int(np.floor((max(start, start + along) + pad - origin) / res)) + 1
    return max(low, 0), min(high, count)


@part()
def voxel_box(at, axis, length, pad, lattice):
    """Of each of three axes the first voxel of `lattice` that a capsule of `length` m from `at` (3,) along `axis` (3,)
    may fill, padded, and the one after the last."""
    res, origin, shape = lattice.resolution, lattice.origin, lattice.shape
    low0, high0 = voxel_range(at[0], axis[0] * length, pad, origin[0], res, shape[0])
    low1, high1 = voxel_range(at[1], axis[1] * length, pad, origin[1], res, shape[1])
    low2, high2 = voxel_range(at[2], axis[2] * length, pad, origin[2], res, shape[2])
    return low0, high0, low1, high1, low2, high2


@part()
def voxel_span(dx, dy, axis, outer, first, res, low, high):
    """Of the voxels `low` to `high` of a row, whose first centre lies `first` voxels from the origin, those within
    √`outer` m of the line through it along `axis`."""
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


@kernel()
def ringing(body, contacts):
    """(L, along + 1): whether any patch in a row of a link, or on its tip, feels contact."""
    rings = np.zeros((len(body.radius), body.along + 1), dtype=np.bool_)
    for patch in range(len(contacts)):
        if contacts[patch]:
            link = body.patch_link[patch]
            rings[link, min((patch - body.first[link]) // body.around, body.along)] = True
    return rings


@kernel()
def room(body, lattice, reach, touched):
    """More than the number of cells at most `reach` (L,) m from the bones of the `touched` (L,) links."""
    voxels = float(lattice.shape[0] * lattice.shape[1] * lattice.shape[2])
    most = 0.0
    for link in range(len(body.radius)):
        if touched[link]:
            radius = reach[link] + lattice.resolution
            volume = np.pi * radius**2 * (body.length[link] + 4.0 / 3.0 * radius)
            most += min(volume / lattice.resolution**3, voxels)
    return int(most) + 1
