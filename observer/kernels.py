"""The compiled inner loop: score candidate poses against maps, and write what was felt into maps.

N particles, J joints, P patches, K candidates, L links, V = X·Y·Z voxels, M points of the skin. Maps are int8
log-odds in units of `QUANTUM`, (N, X, Y, Z). Kernels are pure: random numbers come in, nothing is kept. Loops run in
parallel over particles, each of which is computed in one order: the same bits for any number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.patches import patch_at, row_at
from observer.kinematics import body_frames
from observer.threads import parallel

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
    `log_no_alarm`: that there is no false alarm.
    """

    hit: float
    false_alarm: float
    free: float
    give: float
    edge: float
    deep: float
    shell: float
    fall: float
    blur: float
    near: float
    temper: float
    log_no_alarm: float
    probability: NDArray[np.float64]
    log_clear: NDArray[np.float64]
    log_silent: NDArray[np.float64]


class Reach(NamedTuple):
    """What each link says of the cells about it at one step, given how surely its place is known (L links).

    `free` (L, BINS): quanta of log-odds that a cell loses, by its squared distance from the bone in units of `bin`
    (L,) m²; `carved` (L,) m: the distance from which on it loses nothing. `fall` (L,) m: over what distance beyond the
    shell a cell's part in a touch fades; `felt` (L,) m: the distance from which on it has none.
    """

    free: NDArray[np.int64]
    bin: NDArray[np.float64]
    carved: NDArray[np.float64]
    fall: NDArray[np.float64]
    felt: NDArray[np.float64]


def reach_of(body: Body, evidence: Evidence, place: NDArray[np.float64]) -> Reach:
    """What the links of `body` say of the cells about them, the SD of their places being `place` (L,) m.

    If the cell at depth d beneath the skin were occupied, the link could not be there: what speaks for it is only the
    probability Φ(-d / SD) that it is elsewhere.
    """
    bin = (body.radius + 2.0 * evidence.edge) ** 2 / BINS
    height = np.sqrt((np.arange(BINS) + 0.5) * bin[:, None]) - body.radius[:, None]
    unsure = np.hypot(place, evidence.edge)[:, None]
    lost = -evidence.free * log_ndtr((height + evidence.give) / unsure)
    free = np.minimum(np.round(lost / QUANTUM), LIMIT).astype(np.int64)
    fall = np.hypot(evidence.fall, evidence.blur * place)
    return Reach(
        free=free,
        bin=bin,
        carved=np.sqrt((free > 0).sum(axis=1) * bin),
        fall=fall,
        felt=body.radius + evidence.shell + 2.5 * fall,
    )


def body_of(hand: Hand, resolution: float) -> Body:
    """The arrays of `hand`, with points of the skin about two voxels apart."""
    patches = hand.patches
    skin = patches.surface(2.0 * resolution)
    order = np.argsort(skin.patch, kind="stable")
    lift = 0.5 * resolution * skin.normals
    return Body(
        radius=np.array([link.radius for link in hand.links]),
        length=np.array([link.length for link in hand.links]),
        tip=np.array([link.tip for link in hand.links]),
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


@numba.njit(cache=True, error_model="numpy", fastmath=True)
def _log_likelihood(body, lattice, evidence, link_body, position, rotation, contacts, watched, flat):
    """log p(z | q, m) up to a constant, over the patches of the `watched` (L,) links.

    A touch is a noisy-OR over the cells just outside the patch; silence, over the cells just beneath it, where only
    what is known to be occupied counts: an unknown cell is no reason to stay away.
    """
    total = 0.0
    scale = 1.0 / lattice.resolution
    nx, ny, nz = lattice.shape
    for link in range(len(body.radius)):
        if not watched[link]:
            continue
        # The link's frame in voxels, once for all of its points.
        turn = rotation[link_body[link]]
        at = position[link_body[link]]
        a, b, c = turn[0, 0] * scale, turn[0, 1] * scale, turn[0, 2] * scale
        d, e, f = turn[1, 0] * scale, turn[1, 1] * scale, turn[1, 2] * scale
        g, h, i = turn[2, 0] * scale, turn[2, 1] * scale, turn[2, 2] * scale
        x0 = (at[0] - lattice.origin[0]) * scale
        y0 = (at[1] - lattice.origin[1]) * scale
        z0 = (at[2] - lattice.origin[2]) * scale
        last = body.first[link + 1] if link + 1 < len(body.first) else len(contacts)
        for patch in range(body.first[link], last):
            felt = contacts[patch]
            points = body.points if felt else body.core
            log_clear = evidence.log_clear if felt else evidence.log_silent
            clear = evidence.log_no_alarm if felt else 0.0
            for m in range(body.begin[patch], body.begin[patch + 1]):
                px, py, pz = points[m, 0], points[m, 1], points[m, 2]
                x = x0 + a * px + b * py + c * pz
                y = y0 + d * px + e * py + f * pz
                z = z0 + g * px + h * py + i * pz
                if x < 0.0 or y < 0.0 or z < 0.0 or x >= nx or y >= ny or z >= nz:
                    clear += log_clear[128]  # beyond the grid nothing is known
                else:
                    clear += log_clear[flat[(int(x) * ny + int(y)) * nz + int(z)] + 128]
            total += np.log(max(1.0 - np.exp(clear), 1e-6)) if felt else max(clear, LEAST)
    return total


@numba.njit(cache=True, error_model="numpy", fastmath=True)
def _write(
    body,
    lattice,
    evidence,
    reach,
    link_body,
    position,
    rotation,
    contacts,
    touch,
    rings,
    flat,
    written,
    cells,
    owner,
    hits,
):
    """Update one map with what was felt at one pose: `cells`, `owner` and `hits` are scratch.

    Cells inside a link are free, the surer the deeper (`Reach.free`). Of the cells about the skin of a patch that
    feels contact at least one is occupied: each gets the log of its noisy-OR likelihood ratio given what is known of
    the others, so that a single suspect gets all of the evidence, and one of many next to none. `rings`: of
    `_ringing`.
    """
    res = lattice.resolution
    origin = lattice.origin
    ny, nz = lattice.shape[1], lattice.shape[2]
    for link in range(len(body.radius)):
        at = position[link_body[link]]
        turn = rotation[link_body[link]]
        radius, length = body.radius[link], body.length[link]
        last = body.first[link + 1] if link + 1 < len(body.first) else len(contacts)
        touching = False
        for patch in range(body.first[link], last):
            touching |= contacts[patch]
        pad = max(reach.carved[link], reach.felt[link]) if touching else reach.carved[link]
        low0, high0 = _range(at[0], turn[0, 2] * length, pad, origin[0], res, lattice.shape[0])
        low1, high1 = _range(at[1], turn[1, 2] * length, pad, origin[1], res, ny)
        low2, high2 = _range(at[2], turn[2, 2] * length, pad, origin[2], res, nz)
        outer, carved = pad * pad, reach.carved[link] ** 2
        core, felt = max(radius - evidence.deep, 0.0) ** 2, reach.felt[link] ** 2
        per_bin = 1.0 / reach.bin[link]
        found = 0
        for i in range(low0, high0):
            dx = origin[0] + (i + 0.5) * res - at[0]
            for j in range(low1, high1):
                dy = origin[1] + (j + 0.5) * res - at[1]
                row = (i * ny + j) * nz
                begin, end = _span(dx, dy, turn[:, 2], outer, origin[2] + 0.5 * res - at[2], res, low2, high2)
                for k in range(begin, end):
                    dz = origin[2] + (k + 0.5) * res - at[2]
                    z, square = _from_bone(dx, dy, dz, turn[:, 2], length)
                    if square >= outer:
                        continue
                    if (
                        touching
                        and core <= square < felt
                        and rings[link, row_at(body.length, body.tip, body.along, link, z)]
                    ):
                        x = turn[0, 0] * dx + turn[1, 0] * dy + turn[2, 0] * dz
                        y = turn[0, 1] * dx + turn[1, 1] * dy + turn[2, 1] * dz
                        patch = patch_at(
                            body.first, body.length, body.tip, body.along, body.around, body.rings, link, x, y, z
                        )
                        if contacts[patch]:
                            cells[found] = row + k
                            owner[found] = patch
                            beyond = max(np.sqrt(square) - radius - evidence.shell, 0.0) / reach.fall[link]
                            hits[found] = evidence.hit * np.exp(-0.5 * beyond * beyond)
                            found += 1
                            continue
                    if square < carved:
                        lost = reach.free[link, int(max(square, 0.0) * per_bin)]
                        flat[row + k] = max(flat[row + k] - lost, -LIMIT)
                        if not written[row + k]:
                            written[row + k] = True
        if found == 0:
            continue
        for patch in range(body.first[link], last):
            if contacts[patch]:
                _share(evidence, touch[patch], patch, flat, written, cells, owner, hits, found)


@numba.njit(cache=True, inline="always")
def _from_bone(dx, dy, dz, axis, length):
    """Of a point, from the start of a bone of `length` m along `axis` (3,): its height along it, m, and the square of
    its distance from it, m²."""
    z = axis[0] * dx + axis[1] * dy + axis[2] * dz
    along = min(max(z, 0.0), length)
    return z, dx * dx + dy * dy + dz * dz - 2.0 * z * along + along * along


@numba.njit(cache=True, inline="always")
def _range(start, along, pad, origin, res, count):
    """Voxels along one axis that a capsule from `start` to `start + along` may fill, padded."""
    low = int(np.floor((min(start, start + along) - pad - origin) / res))
    high = int(np.floor((max(start, start + along) + pad - origin) / res)) + 1
    return max(low, 0), min(high, count)


@numba.njit(cache=True, inline="always")
def _span(dx, dy, axis, outer, first, res, low, high):
    """Of the voxels `low` to `high` of a row, those within √`outer` m of the line through the origin along `axis`."""
    across = 1.0 - axis[2] * axis[2]
    if across < 1e-9:
        return low, high
    s = axis[0] * dx + axis[1] * dy
    inside = (s * axis[2]) ** 2 - across * (dx * dx + dy * dy - s * s - outer)
    if inside <= 0.0:
        return low, low
    half = np.sqrt(inside)
    begin = int(np.floor(((s * axis[2] - half) / across - first) / res))
    end = int(np.ceil(((s * axis[2] + half) / across - first) / res)) + 1
    return max(begin, low), min(end, high)


@numba.njit(cache=True)
def _ringing(body, contacts):
    """(L, along + 1): whether any patch in a row of a link, or on its tip, feels contact."""
    rings = np.zeros((len(body.radius), body.along + 1), dtype=np.bool_)
    for patch in range(len(contacts)):
        if contacts[patch]:
            link = body.patch_link[patch]
            rings[link, min((patch - body.first[link]) // body.around, body.along)] = True
    return rings


@numba.njit(cache=True)
def _room(body, lattice, reach):
    """More than the number of cells that may have a part in a touch of any one link."""
    most = 0.0
    for link in range(len(body.radius)):
        radius = reach.felt[link] + lattice.resolution
        most = max(most, np.pi * radius**2 * (body.length[link] + 4.0 / 3.0 * radius))
    return int(most / lattice.resolution**3) + 1


@numba.njit(cache=True, error_model="numpy")
def _share(evidence, touch, patch, flat, written, cells, owner, hits, found):
    """Give the evidence of one touch to the cells that may have caused it."""
    clear = 1.0 - evidence.false_alarm  # probability that nothing rings the patch
    for c in range(found):
        if owner[c] == patch:
            clear *= 1.0 - hits[c] * evidence.probability[flat[cells[c]] + 128]
    for c in range(found):
        if owner[c] == patch:
            cell = cells[c]
            others = clear / (1.0 - hits[c] * evidence.probability[flat[cell] + 128])
            ratio = (1.0 - (1.0 - hits[c]) * others) / (1.0 - others)
            flat[cell] = min(flat[cell] + int(np.round(touch * np.log(ratio) / QUANTUM)), LIMIT)
            if not written[cell]:
                written[cell] = True


@numba.njit(cache=True)
def near_skin(tree, body, lattice, near, pose):
    """(V,): whether the centre of each cell lies within `near` m of the skin, or inside, at `pose` (J,)."""
    result = np.zeros(lattice.shape[0] * lattice.shape[1] * lattice.shape[2], dtype=np.bool_)
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, pose, position, rotation)
    res, origin = lattice.resolution, lattice.origin
    ny, nz = lattice.shape[1], lattice.shape[2]
    for link in range(len(body.radius)):
        at, turn = position[tree.link_body[link]], rotation[tree.link_body[link]]
        length, pad = body.length[link], body.radius[link] + near
        low0, high0 = _range(at[0], turn[0, 2] * length, pad, origin[0], res, lattice.shape[0])
        low1, high1 = _range(at[1], turn[1, 2] * length, pad, origin[1], res, ny)
        low2, high2 = _range(at[2], turn[2, 2] * length, pad, origin[2], res, nz)
        for i in range(low0, high0):
            dx = origin[0] + (i + 0.5) * res - at[0]
            for j in range(low1, high1):
                dy = origin[1] + (j + 0.5) * res - at[1]
                for k in range(low2, high2):
                    dz = origin[2] + (k + 0.5) * res - at[2]
                    if _from_bone(dx, dy, dz, turn[:, 2], length)[1] < pad * pad:
                        result[(i * ny + j) * nz + k] = True
    return result


@parallel(cache=True, error_model="numpy")
def advance(
    tree,
    body,
    lattice,
    evidence,
    reach,
    contacts,
    touch,
    watched,
    centres,
    spread,
    normals,
    uniform,
    average,
    maps,
    written,
    poses,
):
    """Match every particle's pose to its map, then write the contacts into the map at the pose.

    `contacts` (P,), and `touch` (P,) the weight of each patch's touch; `watched` (L,): the links whose patches have a
    say; `reach`: what the links say of the cells about them. `centres` (N, J): mean of each particle's proposal,
    `spread` (J, J) its Cholesky factor, `normals` (N, K, J) and `uniform` (N,) the random numbers. `poses` (N, J) is
    set to the mean of the K candidates by likelihood if `average`, else to one drawn in proportion to it; `written`
    (V,) is set where any map was written.

    Returns the log of the mean likelihood (N,), an unbiased estimate of log ∫ p(z|q,m) p(q|·) dq before the log, and
    whether the likelihood told the candidates apart, so that the match moved the pose (N,).
    """
    particles, candidates, joints = normals.shape
    log_mean = np.zeros(particles)
    moved = np.zeros(particles, dtype=np.bool_)
    matching = watched.any()
    room, rings = _room(body, lattice, reach), _ringing(body, contacts)
    for n in numba.prange(particles):
        position = np.empty((len(tree.parent), 3))
        rotation = np.empty((len(tree.parent), 3, 3))
        candidate = np.empty((candidates, joints))
        score = np.zeros(candidates)
        flat = maps[n].reshape(-1)
        for c in range(candidates):
            for i in range(joints):
                candidate[c, i] = centres[n, i]
                for j in range(i + 1):
                    candidate[c, i] += spread[i, j] * normals[n, c, j]
            if matching:
                body_frames(tree, candidate[c], position, rotation)
                score[c] = evidence.temper * _log_likelihood(
                    body, lattice, evidence, tree.link_body, position, rotation, contacts, watched, flat
                )
        best = score.max()
        total = 0.0
        for c in range(candidates):
            score[c] = np.exp(score[c] - best)
            total += score[c]
        log_mean[n] = best + np.log(total / candidates)
        chosen, reached = 0, score[0]
        while reached < uniform[n] * total and chosen < candidates - 1:
            chosen += 1
            reached += score[chosen]
        moved[n] = score.min() < 0.5 * score.max()
        if average:
            poses[n] = score @ candidate / total
        else:
            poses[n] = candidate[chosen]
        cells = np.empty(room, dtype=np.int64)
        owner = np.empty(room, dtype=np.int64)
        hits = np.empty(room)
        body_frames(tree, poses[n], position, rotation)
        _write(
            body,
            lattice,
            evidence,
            reach,
            tree.link_body,
            position,
            rotation,
            contacts,
            touch,
            rings,
            flat,
            written,
            cells,
            owner,
            hits,
        )
    return log_mean, moved


@parallel(cache=True)
def mean_probability(maps, weights, cells, probability):
    """Posterior probability (C,) of the voxels `cells` (C,): the particles' own, averaged by `weights` (N,)."""
    particles = maps.shape[0]
    flat = maps.reshape(particles, -1)
    result = np.zeros(len(cells))
    for block in numba.prange((len(cells) + 511) // 512):
        begin, end = block * 512, min(block * 512 + 512, len(cells))
        for n in range(particles):
            for c in range(begin, end):
                result[c] += weights[n] * probability[flat[n, cells[c]] + 128]
    return result


@parallel(cache=True)
def copy_maps(maps, source, target):
    """Overwrite the maps `target` (C,) with the maps `source` (C,); no index may be in both."""
    size = maps[0].size
    flat = maps.reshape(maps.shape[0], size)
    for c in numba.prange(len(source)):
        flat[target[c]] = flat[source[c]]
