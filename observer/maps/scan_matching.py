"""The compiled inner loop where the pose is a Gaussian that all particles share.

What a link says of the cells that it sweeps depends on that Gaussian alone: it is said once, to a map that all
particles have in common. A particle keeps the cells that a touch may have been due to, for which its own pose counts.
It lies near the mean, so that points of the skin move with it in a straight line: geometry is done once a step, at the
mean.

N particles, J joints, P patches, K candidates, L links, V voxels, S points that are scored, C cells that a touch may
be due to, A joints that move the links in question, T slots. Log-odds are int8 in units of `QUANTUM`: `common` (V,) to
all; `own` (N, > T) the particles', of the cells for which `slot` (V,) is not -1, and 0 in its last column. Of the one
or the other a cell has nought, so that their sum is what a particle believes.

Kernels are pure: random numbers come in, nothing is kept. Each particle is computed in one order: the same bits for
any number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import inner, kernel, part
from haptic_env.moved import renamed
from observer.kinematics import _moved, _moving, twists
from observer.maps.evidence import LEAST
from observer.maps.suspects import _share
from observer.resampling import exponentiate

__getattr__ = renamed(__name__, {"Scan": "ScoredSkin"})


class ScoredSkin(NamedTuple):
    """Points of the skin that scan matching scores, patch by patch: those of the i-th are `begin[i]` up to
    `begin[i + 1]`, and `felt[i]` says whether it feels contact. `place` (3, S) in voxels, at the mean pose; `gain`
    (A, 3, S) voxels per radian of the joints `active` (A,)."""

    begin: NDArray[np.int64]
    felt: NDArray[np.bool_]
    place: NDArray[np.float64]
    gain: NDArray[np.float64]
    active: NDArray[np.int64]


@kernel()
def scan(tree, body, lattice, stance, contacts, watched, solid, reach):
    """The `ScoredSkin` of the patches of the `watched` (L,) links at the `stance` of the mean pose.

    Of a silent patch only points within `reach` voxels of a cell that is `solid` (V,) to any particle: silence speaks
    of what is known to be occupied alone.
    """
    most = 0
    for patch in range(len(contacts)):
        if watched[body.patch_link[patch]]:
            most += body.begin[patch + 1] - body.begin[patch]
    pose, position, rotation = stance
    active = _moving(tree, watched)
    begin, felt = np.zeros(len(contacts) + 1, dtype=np.int64), np.empty(len(contacts), dtype=np.bool_)
    place, gain, near = np.empty((3, most)), np.empty((len(active), 3, most)), np.empty(3)
    linear, angular, arm = np.empty((len(pose), 3)), np.empty((len(pose), 3)), np.empty(3)
    scale = 1.0 / lattice.resolution
    count = segments = 0
    last = -1
    for patch in range(len(contacts)):
        link = body.patch_link[patch]
        if not watched[link]:
            continue
        own = tree.link_body[link]
        turn, at = rotation[own], position[own]
        if link != last:
            twists(tree, pose, position, rotation, own, linear, angular)
            last = link
        points = body.points if contacts[patch] else body.core
        for m in range(body.begin[patch], body.begin[patch + 1]):
            for i in range(3):
                arm[i] = turn[i, 0] * points[m, 0] + turn[i, 1] * points[m, 1] + turn[i, 2] * points[m, 2]
                near[i] = place[i, count] = (at[i] + arm[i] - lattice.origin[i]) * scale
            if not contacts[patch] and not _beside(solid, lattice.shape, near, reach):
                continue
            for a in range(len(active)):
                moved = _moved(linear[active[a]], angular[active[a]], arm)
                for i in range(3):
                    gain[a, i, count] = moved[i] * scale
            count += 1
        if count > begin[segments]:
            felt[segments] = contacts[patch]
            segments += 1
            begin[segments] = count
    near_place, near_gain = np.empty((3, count)), np.empty((len(active), 3, count))
    for i in range(3):
        for m in range(count):
            near_place[i, m] = place[i, m]
        for a in range(len(active)):
            for m in range(count):
                near_gain[a, i, m] = gain[a, i, m]
    return ScoredSkin(begin[: segments + 1], felt[:segments], near_place, near_gain, active)


@part()
def _beside(solid, shape, place, reach):
    """Whether any marked cell is at most `reach` voxels from that of `place` (3,) voxels along each axis."""
    x, y, z = int(np.floor(place[0])), int(np.floor(place[1])), int(np.floor(place[2]))
    for i in range(max(x - reach, 0), min(x + reach + 1, shape[0])):
        for j in range(max(y - reach, 0), min(y + reach + 1, shape[1])):
            row = (i * shape[1] + j) * shape[2]
            for k in range(max(z - reach, 0), min(z + reach + 1, shape[2])):
                if solid[row + k]:
                    return True
    return False


@part(fastmath=True)
def _shift(gain, active, delta, out):
    """Fill `out` (3, S) with how far `delta` (J,) rad moves points, their `gain` being (A, 3, S)."""
    for i in range(3):
        for m in range(out.shape[1]):
            out[i, m] = 0.0
    for a in range(len(active)):
        turned = delta[active[a]]
        for i in range(3):
            for m in range(out.shape[1]):
                out[i, m] += gain[a, i, m] * turned


@inner()
def _heard(scan, evidence, cell, common, slot, own, n):
    """log p(z | q, m) up to a constant to particle n, the points of `scan` being in `cell` (S,), -1 outside the grid.

    Without `fastmath`, which would take the factors in another order with threads than without.
    """
    total, rung = 0.0, 1.0  # log probability of what is silent, probability of what is felt
    for patch in range(len(scan.felt)):
        begin, end = scan.begin[patch], scan.begin[patch + 1]
        # A branch for cells without a slot would take three times as long.
        if scan.felt[patch]:
            clear = 1.0 - evidence.false_alarm
            for m in range(begin, end):
                entry = common[cell[m]] + own[n, slot[cell[m]]] if cell[m] >= 0 else 0  # outside, nothing is known
                clear *= 1.0 - evidence.hit * evidence.probability[entry + 128]
            rung *= max(1.0 - clear, 1e-6)
            if rung < 1e-200:  # before it is too small for a number
                total, rung = total + np.log(rung), 1.0
        else:
            quiet = 0.0
            for m in range(begin, end):
                entry = common[cell[m]] + own[n, slot[cell[m]]] if cell[m] >= 0 else 0
                quiet += evidence.log_silent[entry + 128]
            total += max(quiet, LEAST)
    return total + np.log(rung)


@inner(fastmath=True)
def _score(scan, lattice, evidence, deviation, away, common, slot, own, n, place, shift, cell, score):
    """Fill `score` (K,) with log p(z | q, m) of the candidates up to a constant, to particle n: they lie `deviation`
    (J,) plus and minus each of `away` (K // 2, J) rad from the mean. `place` and `shift` (3, S) and `cell` (S,) are
    scratch.

    A touch is a noisy-OR over the cells just outside the patch; silence, over the cells just beneath it, where only
    what is known to be occupied counts: an unknown cell is no reason to stay away.
    """
    nx, ny, nz = lattice.shape
    _shift(scan.gain, scan.active, deviation, place)
    for i in range(3):
        for m in range(len(cell)):
            place[i, m] += scan.place[i, m]
            shift[i, m] = 0.0
    for c in range(len(score)):
        sign = 1.0 - 2.0 * (c % 2)
        if c // 2 == len(away):
            sign = 0.0
        elif c % 2 == 0:
            _shift(scan.gain, scan.active, away[c // 2], shift)
        for m in range(len(cell)):
            x = place[0, m] + sign * shift[0, m]
            y = place[1, m] + sign * shift[1, m]
            z = place[2, m] + sign * shift[2, m]
            inside = (x >= 0.0) & (y >= 0.0) & (z >= 0.0) & (x < nx) & (y < ny) & (z < nz)
            cell[m] = (int(x) * ny + int(y)) * nz + int(z) if inside else -1
        score[c] = evidence.temper * _heard(scan, evidence, cell, common, slot, own, n)


@kernel()
def match_and_touch(
    begin,
    end,
    scan,
    suspects,
    where,
    lattice,
    evidence,
    candidates,
    deviations,
    spread,
    normals,
    common,
    slot,
    own,
    touched,
    solid,
    poses,
    log_mean,
    moved,
):
    """Match the poses of the particles from `begin` to `end` to their maps, then write the touches into the maps at the
    matched poses.

    `where` (C,) are the slots of the suspects. `deviations` (N, J) rad of each particle's proposal from the mean pose.
    Candidates come in pairs about it, as far as the Cholesky factor `spread` (J, J) of all that is uncertain and
    `normals` (N, K // 2, J) say; where K is odd, or 1, the last one is the proposal itself. `poses` (N, J) is set to
    the mean of the K `candidates` by likelihood, rad from the mean pose; `touched` and `solid` (V,) where any
    particle's map was written, and where it says occupied rather than free.

    Fills the log of the mean likelihood `log_mean` (N,), an unbiased estimate of log ∫ p(z|q,m) p(q|·) dq before the
    log, and `moved` (N,), whether the likelihood told the candidates apart, so that the match moved the pose.
    """
    pairs, joints = normals.shape[1:]
    points, cells = scan.place.shape[1], len(suspects.cell)
    place, shift, cell = np.empty((3, points)), np.empty((3, points)), np.empty(points, dtype=np.int64)
    away, score = np.empty((pairs, joints)), np.empty(candidates)
    hits, ring = np.empty(cells), np.empty(cells)
    for n in range(begin, end):
        for h in range(pairs):
            for i in range(joints):
                away[h, i] = 0.0
                for j in range(i + 1):
                    away[h, i] += spread[i, j] * normals[n, h, j]
        _score(scan, lattice, evidence, deviations[n], away, common, slot, own, n, place, shift, cell, score)
        best, least, total = exponentiate(score)
        log_mean[n] = best + np.log(total / candidates)
        moved[n] = best - least > np.log(2.0)
        for i in range(joints):
            poses[n, i] = deviations[n, i]
            for h in range(pairs):
                poses[n, i] += (score[2 * h] - score[2 * h + 1]) / total * away[h, i]
        _share(suspects, where, evidence, poses[n], own, n, touched, solid, hits, ring)
