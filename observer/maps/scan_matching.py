"""The compiled inner loop where the pose is a Gaussian that all particles share: each matches its pose to its own map.

What a link says of the cells that it sweeps depends on that Gaussian alone: it is said once, to a map that all
particles have in common. A particle keeps the cells that a touch may have been due to, for which its own pose counts.

N particles, J joints, P patches, K candidates, V voxels, S points that are scored, C cells that a touch may be due to,
A joints that move the links in question. Maps are those of `observer.maps.occupancy.ParticleMaps`.

Kernels are pure: random numbers come in, nothing is kept. Each particle is computed in one order: the same bits for
any number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import kernel, part
from haptic_env.moved import renamed
from observer.maps.contact_model import LEAST, LIMIT, QUANTUM, cause_evidence
from observer.maps.matching_geometry import ScoredSkin, TouchCauses
from observer.resampling import exponentiate

__getattr__ = renamed(__name__, {"Scan": "ScoredSkin"})

FARTHEST = 2.5  # SDs beyond the shell, where a cell's part in a touch ends
FADE = np.exp(-0.5 * ((np.arange(256) + 0.5) / 256 * FARTHEST) ** 2)  # of it, by the SDs beyond the shell


class MapQuery(NamedTuple):
    """What matching asks of the maps.

    Attributes:
        skin: points that are scored.
        causes: cells that touches may be due to.
        slots: (C,) where particles keep those.
    """

    skin: ScoredSkin
    causes: TouchCauses
    slots: NDArray[np.int64]


class Candidates(NamedTuple):
    """Where each particle's pose may be, beside its proposal.

    Attributes:
        number: K.
        centres: (N, J) rad, of the proposals.
        factor: (J, J) rad, Cholesky factor of how far candidates lie from them.
        normals: (N, K, J) or, where they come in pairs, (N, K // 2, J), random numbers.
    """

    number: int
    centres: Array
    factor: Array
    normals: NDArray[np.floating]


class Matched(NamedTuple):
    """What becomes of each particle.

    Attributes:
        poses: (N, J) rad.
        log_likelihood: (N,) log of the mean likelihood of its candidates, an unbiased estimate of
            log ∫ p(z|q,m) p(q|·) dq before the log.
        moved: (N,) whether the likelihood told the candidates apart, so that the match moved the pose.
    """

    poses: Array
    log_likelihood: Array
    moved: NDArray[np.bool_]


class Scratch(NamedTuple):
    """Room for one particle: `away` (K // 2, J) rad and `score` (K,) of its candidates, `place` and `shift` (3, S)
    voxels and `cell` (S,) of points, `hits` and `ring` (C,) of cells."""

    away: Array
    score: Array
    place: Array
    shift: Array
    cell: NDArray[np.int64]
    hits: Array
    ring: Array


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


@part()
def _heard(skin, evidence, maps, n, cell):
    """Of the map of particle n, the points of `skin` being in `cell` (S,), -1 outside the grid.

    Without `fastmath`, which would take the factors in another order with threads than without.

    Returns:
        log p(z | q, m) up to a constant.
    """
    common, slot, own = maps.common, maps.slot, maps.own
    total, rung = 0.0, 1.0  # log probability of what is silent, probability of what is felt
    for patch in range(len(skin.felt)):
        begin, end = skin.begin[patch], skin.begin[patch + 1]
        # A branch for cells without a slot would take three times as long.
        if skin.felt[patch]:
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


@part(fastmath=True)
def _score(skin, evidence, maps, n, deviation, scratch):
    """Fill `scratch.score` with log p(z | q, m) of the candidates up to a constant, to particle n: they lie `deviation`
    (J,) plus and minus each of `scratch.away` from the mean.

    A touch is a noisy-OR over the cells just outside the patch; silence, over the cells just beneath it, where only
    what is known to be occupied counts: an unknown cell is no reason to stay away.
    """
    nx, ny, nz = maps.shape
    _, score, place, shift, cell, _, _ = scratch
    away = scratch.away
    _shift(skin.gain, skin.active, deviation, place)
    for i in range(3):
        for m in range(len(cell)):
            place[i, m] += skin.place[i, m]
            shift[i, m] = 0.0
    for c in range(len(score)):
        sign = 1.0 - 2.0 * (c % 2)
        if c // 2 == len(away):
            sign = 0.0
        elif c % 2 == 0:
            _shift(skin.gain, skin.active, away[c // 2], shift)
        for m in range(len(cell)):
            x = place[0, m] + sign * shift[0, m]
            y = place[1, m] + sign * shift[1, m]
            z = place[2, m] + sign * shift[2, m]
            inside = (x >= 0.0) & (y >= 0.0) & (z >= 0.0) & (x < nx) & (y < ny) & (z < nz)
            cell[m] = (int(x) * ny + int(y)) * nz + int(z) if inside else -1
        score[c] = evidence.temper * _heard(skin, evidence, maps, n, cell)


@part(fastmath=True)
def _share(query, evidence, maps, n, delta, hits, ring):
    """Give the evidence of each touch to the cells that may have caused it, in the map of particle n, whose pose is
    `delta` (J,) rad from the mean. `hits` and `ring` (C,) are scratch."""
    causes, where, own = query.causes, query.slots, maps.own
    for c in range(len(causes.cell)):
        hits[c] = causes.height[c]
    for a in range(len(causes.active)):
        turned = delta[causes.active[a]]
        for c in range(len(causes.cell)):
            hits[c] += causes.slope[a, c] * turned
    for patch in range(len(causes.weight)):
        begin, end = causes.begin[patch], causes.begin[patch + 1]
        per_fall, weight = 1.0 / causes.fall[patch], causes.weight[patch] / QUANTUM
        clear = 1.0 - evidence.false_alarm  # probability that nothing rings the patch
        for c in range(begin, end):
            beyond = max(hits[c] - evidence.shell, 0.0) * per_fall
            if hits[c] < -evidence.deep or beyond >= FARTHEST:
                hits[c], ring[c] = 0.0, 1.0
                continue
            hits[c] = evidence.hit * FADE[int(beyond * (len(FADE) / FARTHEST))]
            ring[c] = 1.0 - hits[c] * evidence.probability[own[n, where[c]] + 128]
            clear *= ring[c]
        for c in range(begin, end):
            quanta = cause_evidence(hits[c], ring[c], clear, weight, 0.5)
            if quanta == 0.0:
                continue
            new = min(own[n, where[c]] + int(quanta + 0.5), LIMIT)
            own[n, where[c]] = new
            if not maps.touched[causes.cell[c]]:
                maps.touched[causes.cell[c]] = True
            if new >= evidence.solid and not maps.solid[causes.cell[c]]:
                maps.solid[causes.cell[c]] = True


@kernel()
def match_and_touch(begin, end, query, evidence, candidates, maps, matched):
    """Match the poses of particles to their maps, then write the touches into the maps at the matched poses.

    Candidates come in pairs about a proposal; where K is odd, or 1, the last one is the proposal itself. A particle
    takes their mean by likelihood.

    Args:
        begin: the first particle.
        end: the one after the last.
        query: what is asked of the maps.
        evidence: the contact model.
        candidates: the `Candidates`, rad from the mean pose.
        maps: the `ParticleMaps`.
        matched: is filled, `Matched` rad from the mean pose.
    """
    pairs, joints = candidates.normals.shape[1:]
    points, cells = query.skin.place.shape[1], len(query.causes.cell)
    scratch = Scratch(
        np.empty((pairs, joints)),
        np.empty(candidates.number),
        np.empty((3, points)),
        np.empty((3, points)),
        np.empty(points, dtype=np.int64),
        np.empty(cells),
        np.empty(cells),
    )
    away, score, poses, deviations = scratch.away, scratch.score, matched.poses, candidates.centres
    for n in range(begin, end):
        for h in range(pairs):
            for i in range(joints):
                away[h, i] = 0.0
                for j in range(i + 1):
                    away[h, i] += candidates.factor[i, j] * candidates.normals[n, h, j]
        _score(query.skin, evidence, maps, n, deviations[n], scratch)
        best, least, total = exponentiate(score)
        matched.log_likelihood[n] = best + np.log(total / candidates.number)
        matched.moved[n] = best - least > np.log(2.0)
        for i in range(joints):
            poses[n, i] = deviations[n, i]
            for h in range(pairs):
                poses[n, i] += (score[2 * h] - score[2 * h + 1]) / total * away[h, i]
        _share(query, evidence, maps, n, poses[n], scratch.hits, scratch.ring)
