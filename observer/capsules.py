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
from observer.kinematics import body_frames, place_spread

QUANTUM = 0.05  # log-odds per unit of the int8 maps, which thus reach ±6.35
LIMIT = 127
LEAST = np.log(1e-6)  # of the probability of one patch: nothing is impossible
LOG_ODDS = QUANTUM * np.arange(-128, 128)  # of a map entry v at [v + 128], above those of the prior
BINS = 64  # of the squared distance from a bone, in tables of what a link says of a cell


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


class Evidence(NamedTuple):
    """The numbers of `observer.contact_model.ContactModel`, for the kernels; lengths in metres.

    Tables (256,) of a map entry v at [v + 128]: `probability` that the cell is occupied, `log_clear` log of the
    probability that it rings no patch, and `log_silent` the same where only what is known to be occupied counts.
    `depth` (LIMIT,): how many SDs above the skin a cell lies at most that loses at least 1, 2, … quanta to a sweep.
    `log_no_alarm`: that there is no false alarm. `solid`: the least map entry that says occupied rather than free.
    """

    hit: float
    false_alarm: float
    give: float
    edge: float
    deep: float
    shell: float
    fall: float
    blur: float
    near: float
    temper: float
    log_no_alarm: float
    solid: int
    probability: NDArray[np.float64]
    log_clear: NDArray[np.float64]
    log_silent: NDArray[np.float64]
    depth: NDArray[np.float64]


class Reach(NamedTuple):
    """What each link says of the cells about it at one step, given how surely its place is known (L links).

    `place` (L,) m: SD of its place along any one axis, as far as maps allow for it.
    `free` (L, BINS): quanta of log-odds that a cell loses, by its squared distance from the bone in units of `bin`
    (L,) m²; `carved` (L,) m: the distance from which on it loses nothing. `fall` (L,) m: over what distance beyond the
    shell a cell's part in a touch fades; `felt` (L,) m: the distance from which on it has none.
    """

    place: NDArray[np.float64]
    free: NDArray[np.int64]
    bin: NDArray[np.float64]
    carved: NDArray[np.float64]
    fall: NDArray[np.float64]
    felt: NDArray[np.float64]

    def of(self, links: NDArray[np.bool_]) -> Reach:
        """The same where only `links` (L,) sweep anything away."""
        if links.all():
            return self
        return self._replace(free=np.where(links[:, None], self.free, 0), carved=np.where(links, self.carved, 0.0))


class Stance(NamedTuple):
    """How the hand stands: at the angles `pose` (J,), with the frames of its bodies at `position` (B, 3) m and
    `rotation` (B, 3, 3)."""

    pose: NDArray[np.float64]
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]


@kernel()
def reach_of(body, evidence, place):
    """The `Reach` of the links of `body`, the SD of their places being `place` (L,) m.

    If the cell at depth d beneath the skin were occupied, the link could not be there: what speaks for it is only the
    probability Φ(-d / SD) that it is elsewhere. The log of that, in quanta, is looked up from the other side: how deep
    a cell must lie to lose so many (`Evidence.depth`).
    """
    links = len(place)
    free, bin, carved = np.zeros((links, BINS), dtype=np.int64), np.empty(links), np.empty(links)
    fall, felt = np.empty(links), np.empty(links)
    for link in range(links):
        bin[link], carved[link] = (body.radius[link] + 2.0 * evidence.edge) ** 2 / BINS, 0.0
        fall[link] = np.hypot(evidence.fall, evidence.blur * place[link])
        felt[link] = body.radius[link] + evidence.shell + 2.5 * fall[link]
        unsure = np.hypot(place[link], evidence.edge)
        lost = LIMIT
        for b in range(BINS):
            height = np.sqrt((b + 0.5) * bin[link]) - body.radius[link]
            while lost > 0 and height + evidence.give > evidence.depth[lost - 1] * unsure:
                lost -= 1
            if lost == 0:
                break
            free[link, b] = lost
            carved[link] = np.sqrt((b + 1) * bin[link]) * (1.0 - 1e-12)  # rounding leads to no bin beyond the last
    return Reach(place, free, bin, carved, fall, felt)


@kernel()
def stand(tree, body, evidence, caution, pose, covariance):
    """The `Stance` of the hand at the mean `pose` (J,), and the `Reach` of its links, `caution` times as far as the
    `covariance` (J, J) rad² of the pose leaves their places unknown."""
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, pose, position, rotation)
    place = place_spread(tree, body.length, pose, covariance, position, rotation)
    for link in range(len(place)):
        place[link] *= caution
    return Stance(pose, position, rotation), reach_of(body, evidence, place)


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
