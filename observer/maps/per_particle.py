"""The compiled inner loop where the pose is all the particles': each has the whole of the map at its own pose.

N particles, J joints, P patches, K candidates, L links, V = X·Y·Z voxels, M points of the skin. Maps are int8
log-odds in units of `QUANTUM`, (N, V). Kernels are pure: random numbers come in, nothing is kept. Each
particle is computed in one order: the same bits for any number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part
from haptic_env.patches import row_at
from observer.kinematics import body_frames
from observer.maps.capsules import BodyFrames, any_of, owner, ringing
from observer.maps.contact_model import LEAST, LIMIT, QUANTUM, cause_evidence
from observer.maps.free_space import capsule_voxels, from_point, room, triple
from observer.resampling import exponentiate


class Suspects(NamedTuple):
    """Cells that the touches of a link may be due to: their `cell` (C,), the touched `patch` (C,) that is nearest, and
    the probability `hits` (C,) that they ring it if they are occupied."""

    cell: NDArray[np.int64]
    patch: NDArray[np.int64]
    hits: Array


@part(fastmath=True)
def _log_likelihood(felt, frames, flat):
    """Of one map, over the patches of the watched links.

    A touch is a noisy-OR over the cells just outside the patch; silence, over the cells just beneath it, where only
    what is known to be occupied counts: an unknown cell is no reason to stay away.

    Returns:
        log p(z | q, m) up to a constant.
    """
    body, lattice, evidence, contacts, first = (
        felt.body,
        felt.lattice,
        felt.evidence,
        felt.contacts,
        felt.body.layout.first,
    )
    total = 0.0
    scale = 1.0 / lattice.resolution
    nx, ny, nz = lattice.shape
    for link in range(len(body.radius)):
        if not felt.watched[link]:
            continue
        # The link's frame in voxels, once for all of its points.
        turn = frames.rotation[felt.tree.link_body[link]]
        at = frames.position[felt.tree.link_body[link]]
        a, b, c = turn[0, 0] * scale, turn[0, 1] * scale, turn[0, 2] * scale
        d, e, f = turn[1, 0] * scale, turn[1, 1] * scale, turn[1, 2] * scale
        g, h, i = turn[2, 0] * scale, turn[2, 1] * scale, turn[2, 2] * scale
        x0 = (at[0] - lattice.origin[0]) * scale
        y0 = (at[1] - lattice.origin[1]) * scale
        z0 = (at[2] - lattice.origin[2]) * scale
        last = first[link + 1] if link + 1 < len(first) else len(contacts)
        for patch in range(first[link], last):
            touched = contacts[patch]
            points = body.points if touched else body.core
            log_clear = evidence.log_clear if touched else evidence.log_silent
            clear = evidence.log_no_alarm if touched else 0.0
            for m in range(body.begin[patch], body.begin[patch + 1]):
                px, py, pz = points[m, 0], points[m, 1], points[m, 2]
                x = x0 + a * px + b * py + c * pz
                y = y0 + d * px + e * py + f * pz
                z = z0 + g * px + h * py + i * pz
                if x < 0.0 or y < 0.0 or z < 0.0 or x >= nx or y >= ny or z >= nz:
                    clear += log_clear[128]  # beyond the grid nothing is known
                else:
                    clear += log_clear[flat[(int(x) * ny + int(y)) * nz + int(z)] + 128]
            total += np.log(max(1.0 - np.exp(clear), 1e-6)) if touched else max(clear, LEAST)
    return total


@inner(fastmath=True)
def _write(felt, frames, rings, flat, written, found, suspects):
    """Update one map with what was felt at one pose: `found` and `suspects` are scratch.

    Cells inside a link are free, the surer the deeper (`LinkEvidence.free`), but for those about the skin of a patch
    that feels contact, which share its evidence. `rings`: of `ringing`.
    """
    body, lattice, evidence, reach, contacts = felt.body, felt.lattice, felt.evidence, felt.reach, felt.contacts
    first = body.layout.first
    for link in range(len(body.radius)):
        at = triple(frames.position[felt.tree.link_body[link]])
        turn = frames.rotation[felt.tree.link_body[link]]
        radius, touching = body.radius[link], any_of(rings[link])
        pad = max(reach.carved[link], reach.felt[link]) if touching else reach.carved[link]
        carved, core, outer = reach.carved[link] ** 2, max(radius - evidence.deep, 0.0) ** 2, reach.felt[link] ** 2
        per_bin, count = 1.0 / reach.bin[link], 0
        for v in range(capsule_voxels(lattice, at, triple(turn[:, 2]), body.layout.length[link], pad, found)):
            cell, square = found.cell[v], found.square[v]
            if touching and core <= square < outer and rings[link, row_at(body.layout, link, found.along[v])]:
                patch = owner(body, link, turn, from_point(lattice, cell, at))
                if patch >= 0 and contacts[patch]:
                    suspects.cell[count], suspects.patch[count] = cell, patch
                    beyond = max(np.sqrt(square) - radius - evidence.shell, 0.0) / reach.fall[link]
                    suspects.hits[count] = evidence.hit * np.exp(-0.5 * beyond * beyond)
                    count += 1
                    continue
            if square < carved:
                lost = reach.free[link, int(max(square, 0.0) * per_bin)]
                flat[cell] = max(flat[cell] - lost, -LIMIT)
                if not written[cell]:
                    written[cell] = True
        if count == 0:
            continue
        last = first[link + 1] if link + 1 < len(first) else len(contacts)
        for patch in range(first[link], last):
            if contacts[patch]:
                _share(felt, patch, flat, written, suspects, count)


@inner()
def _share(felt, patch, flat, written, suspects, count):
    """Give the evidence of one touch to the cells that may have caused it, of the first `count` of `suspects`."""
    evidence = felt.evidence
    clear = 1.0 - evidence.false_alarm  # probability that nothing rings the patch
    for c in range(count):
        if suspects.patch[c] == patch:
            clear *= 1.0 - suspects.hits[c] * evidence.probability[flat[suspects.cell[c]] + 128]
    for c in range(count):
        if suspects.patch[c] == patch:
            cell, hits = suspects.cell[c], suspects.hits[c]
            mine = 1.0 - hits * evidence.probability[flat[cell] + 128]
            quanta = cause_evidence(hits, mine, clear, felt.touch[patch] / QUANTUM, 0.0)
            flat[cell] = min(flat[cell] + int(np.round(quanta)), LIMIT)
            if not written[cell]:
                written[cell] = True


@kernel()
def advance(begin, end, felt, candidates, uniform, maps, matched):
    """Match the poses of particles to their maps, then write the contacts into the maps at the poses.

    A particle takes one of its candidates, drawn in proportion to its likelihood.

    Args:
        begin: the first particle.
        end: the one after the last.
        felt: of the step.
        candidates: the `Candidates`.
        uniform: (N,) random numbers.
        maps: the `ParticleMaps`, in which every cell has a slot; stale is then where any map was written.
        matched: is filled, `Matched`.
    """
    tree, rings, written, poses = felt.tree, ringing(felt.body, felt.contacts), maps.stale, matched.poses
    count, joints = candidates.number, poses.shape[1]
    matching = any_of(felt.watched)
    position, rotation = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
    frames, candidate, score = BodyFrames(position, rotation), np.empty((count, joints)), np.empty(count)
    found = room(felt, 0.0)
    most = len(found.cell)
    suspects = Suspects(np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64), np.empty(most))
    for n in range(begin, end):
        flat = maps.own[n]
        for c in range(count):
            score[c] = 0.0
            for i in range(joints):
                candidate[c, i] = candidates.centres[n, i]
                for j in range(i + 1):
                    candidate[c, i] += candidates.factor[i, j] * candidates.normals[n, c, j]
            if matching:
                body_frames(tree, candidate[c], position, rotation)
                score[c] = felt.evidence.temper * _log_likelihood(felt, frames, flat)
        best, least, total = exponentiate(score)
        matched.log_likelihood[n] = best + np.log(total / count)
        chosen, reached = 0, score[0]
        while reached < uniform[n] * total and chosen < count - 1:
            chosen += 1
            reached += score[chosen]
        matched.moved[n] = np.exp(least - best) < 0.5
        for j in range(joints):
            poses[n, j] = candidate[chosen, j]
        body_frames(tree, poses[n], position, rotation)
        _write(felt, frames, rings, flat, written, found, suspects)
