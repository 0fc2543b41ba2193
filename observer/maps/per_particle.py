"""The compiled inner loop where the pose is all the particles': each has the whole of the map at its own pose.

N particles, J joints, P patches, K candidates, L links, V = X·Y·Z voxels, M points of the skin. Maps are int8
log-odds in units of `QUANTUM`, (N, V). Kernels are pure: random numbers come in, nothing is kept. Each
particle is computed in one order: the same bits for any number of threads.
"""

from __future__ import annotations

import numpy as np

from haptic_env.compiled import kernel
from haptic_env.patches import patch_at, row_at
from observer.kinematics import body_frames
from observer.maps.capsules import from_bone, ringing, room, voxel_box, voxel_span
from observer.maps.cells import any_of
from observer.maps.evidence import LEAST, LIMIT, QUANTUM
from observer.maps.noisy_or import evidence as evidence_of
from observer.maps.suspects import touched_links
from observer.resampling import exponentiate


@kernel(fastmath=True)
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


@kernel(fastmath=True)
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

    Cells inside a link are free, the surer the deeper (`reach.free`), but for those about the skin of a patch that
    feels contact, which share its evidence. `rings`: of `ringing`.
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
        low0, high0, low1, high1, low2, high2 = voxel_box(at, turn[:, 2], length, pad, lattice)
        outer, carved = pad * pad, reach.carved[link] ** 2
        core, felt = max(radius - evidence.deep, 0.0) ** 2, reach.felt[link] ** 2
        per_bin, first = 1.0 / reach.bin[link], (origin[2] - at[2]) / res + 0.5
        found = 0
        for i in range(low0, high0):
            dx = origin[0] + (i + 0.5) * res - at[0]
            for j in range(low1, high1):
                dy = origin[1] + (j + 0.5) * res - at[1]
                row = (i * ny + j) * nz
                begin, end = voxel_span(dx, dy, turn[:, 2], outer, first, res, low2, high2)
                for k in range(begin, end):
                    dz = origin[2] + (k + 0.5) * res - at[2]
                    z, square = from_bone(dx, dy, dz, turn[:, 2], length)
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


@kernel()
def _share(evidence, touch, patch, flat, written, cells, owner, hits, found):
    """Give the evidence of one touch to the cells that may have caused it."""
    clear = 1.0 - evidence.false_alarm  # probability that nothing rings the patch
    for c in range(found):
        if owner[c] == patch:
            clear *= 1.0 - hits[c] * evidence.probability[flat[cells[c]] + 128]
    for c in range(found):
        if owner[c] == patch:
            cell = cells[c]
            mine = 1.0 - hits[c] * evidence.probability[flat[cell] + 128]
            quanta = evidence_of(hits[c], mine, clear, touch / QUANTUM, 0.0)
            flat[cell] = min(flat[cell] + int(np.round(quanta)), LIMIT)
            if not written[cell]:
                written[cell] = True


@kernel()
def advance(
    begin,
    end,
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
    maps,
    written,
    poses,
    log_mean,
    moved,
):
    """Match the poses of the particles from `begin` to `end` to their maps, then write the contacts into the maps at
    the poses.

    `contacts` (P,), and `touch` (P,) the weight of each patch's touch; `watched` (L,): the links whose patches have a
    say; `reach`: what the links say of the cells about them. `centres` (N, J): mean of each particle's proposal,
    `spread` (J, J) its Cholesky factor, `normals` (N, K, J) and `uniform` (N,) the random numbers. `poses` (N, J) is
    set to one of the K candidates, drawn in proportion to its likelihood; `written` (V,) is set where any map was
    written.

    Fills the log of the mean likelihood `log_mean` (N,), an unbiased estimate of log ∫ p(z|q,m) p(q|·) dq before the
    log, and `moved` (N,), whether the likelihood told the candidates apart, so that the match moved the pose.
    """
    candidates, joints = normals.shape[1:]
    matching = any_of(watched)
    most, rings = room(body, lattice, reach.felt, touched_links(body, contacts)), ringing(body, contacts)
    for n in range(begin, end):
        position = np.empty((len(tree.parent), 3))
        rotation = np.empty((len(tree.parent), 3, 3))
        candidate = np.empty((candidates, joints))
        score = np.empty(candidates)
        for c in range(candidates):
            score[c] = 0.0
        flat = maps[n]
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
        best, least, total = exponentiate(score)
        log_mean[n] = best + np.log(total / candidates)
        chosen, reached = 0, score[0]
        while reached < uniform[n] * total and chosen < candidates - 1:
            chosen += 1
            reached += score[chosen]
        moved[n] = np.exp(least - best) < 0.5
        for j in range(joints):
            poses[n, j] = candidate[chosen, j]
        cells = np.empty(most, dtype=np.int64)
        owner = np.empty(most, dtype=np.int64)
        hits = np.empty(most)
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
