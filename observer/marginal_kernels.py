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
from haptic_env.patches import patch_at, row_at
from observer.capsules import LEAST, LIMIT, QUANTUM, from_bone, ringing, room, triple, voxel_box, voxel_span
from observer.kinematics import twists

FARTHEST = 2.5  # SDs beyond the shell, where a cell's part in a touch ends
FADE = np.exp(-0.5 * ((np.arange(256) + 0.5) / 256 * FARTHEST) ** 2)  # of it, by the SDs beyond the shell


class Scan(NamedTuple):
    """Points of the skin that scan matching scores, patch by patch: those of the i-th are `begin[i]` up to
    `begin[i + 1]`, and `felt[i]` says whether it feels contact. `place` (3, S) in voxels, at the mean pose; `gain`
    (A, 3, S) voxels per radian of the joints `active` (A,)."""

    begin: NDArray[np.int64]
    felt: NDArray[np.bool_]
    place: NDArray[np.float64]
    gain: NDArray[np.float64]
    active: NDArray[np.int64]


class Suspects(NamedTuple):
    """Cells that the touches may be due to, patch by patch: those of the i-th are `begin[i]` up to `begin[i + 1]`,
    `weight[i]` is the weight of its touch and `fall[i]` m what a cell's part in it fades over. `cell` (C,); `height`
    (C,) m above the skin at the mean pose; `slope` (A, C) m per radian of the joints `active` (A,)."""

    begin: NDArray[np.int64]
    weight: NDArray[np.float64]
    fall: NDArray[np.float64]
    cell: NDArray[np.int64]
    height: NDArray[np.float64]
    slope: NDArray[np.float64]
    active: NDArray[np.int64]


@kernel()
def _moving(tree, links):
    """The joints (A,) that move any of the `links` (L,) that are marked."""
    moves, count = np.zeros(len(tree.axis), dtype=np.bool_), 0
    for link in range(len(links)):
        body = tree.link_body[link] if links[link] else 0
        while body > 0:
            for joint in range(tree.first_joint[body], tree.first_joint[body + 1]):
                count += not moves[joint]
                moves[joint] = True
            body = tree.parent[body]
    result, found = np.empty(count, dtype=np.int64), 0
    for joint in range(len(moves)):
        if moves[joint]:
            result[found] = joint
            found += 1
    return result


@inner()
def any_of(flags):
    """Whether any of `flags` (M,) is set."""
    for flag in flags:  # noqa: SIM110 - compiled
        if flag:
            return True
    return False


@kernel()
def scan(tree, body, lattice, stance, contacts, watched, solid, reach):
    """The `Scan` of the patches of the `watched` (L,) links at the `stance` of the mean pose.

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
    return Scan(begin[: segments + 1], felt[:segments], near_place, near_gain, active)


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


@kernel()
def touched_links(body, contacts):
    """(L,) the links of which any patch feels contact."""
    touched = np.zeros(len(body.radius), dtype=np.bool_)
    for patch in range(len(contacts)):
        touched[body.patch_link[patch]] |= contacts[patch]
    return touched


@inner()
def gather(
    link_body, body, lattice, evidence, felt, contacts, touched, rings, margin, position, rotation, cells, owner, height
):
    """Fill `cells`, `owner` and `height` with the cells that touches may be due to, their patches, and how high they
    lie above the skin, m; returns how many. Those as far as `felt` (L,) m from the bones of the `touched` (L,) links,
    and `margin` m more."""
    count = 0
    res, origin = lattice.resolution, lattice.origin
    ny, nz = lattice.shape[1], lattice.shape[2]
    for link in range(len(body.radius)):
        if not touched[link]:
            continue
        at, turn = position[link_body[link]], rotation[link_body[link]]
        length, radius = body.length[link], body.radius[link]
        pad = felt[link] + margin
        low0, high0, low1, high1, low2, high2 = voxel_box(at, turn[:, 2], length, pad, lattice)
        outer, inner = pad * pad, max(radius - evidence.deep - margin, 0.0) ** 2
        first = (origin[2] - at[2]) / res + 0.5
        for i in range(low0, high0):
            dx = origin[0] + (i + 0.5) * res - at[0]
            for j in range(low1, high1):
                dy = origin[1] + (j + 0.5) * res - at[1]
                begin, end = voxel_span(dx, dy, turn[:, 2], outer, first, res, low2, high2)
                for k in range(begin, end):
                    dz = origin[2] + (k + 0.5) * res - at[2]
                    z, square = from_bone(dx, dy, dz, turn[:, 2], length)
                    if not inner <= square < outer:
                        continue
                    if not rings[link, row_at(body.length, body.tip, body.along, link, z)]:
                        continue
                    patch = _owner(body, turn, link, dx, dy, dz)
                    if contacts[patch]:
                        cells[count] = (i * ny + j) * nz + k
                        owner[count] = patch
                        height[count] = np.sqrt(square) - radius
                        count += 1
    return count


@kernel()
def suspects(tree, body, lattice, evidence, reach, stance, contacts, touch, margin):
    """The `Suspects` of all `contacts` (P,) at the `stance` of the mean pose, `touch` (P,) being the weights of the
    touches.

    Cells up to `margin` m too high or too low are among them, for the pose of a particle is not the mean.
    """
    pose, position, rotation = stance
    touched = touched_links(body, contacts)
    most = room(body, lattice, reach.felt + margin, touched)
    cells, owner, height = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64), np.empty(most)
    rings = ringing(body, contacts)
    count = gather(
        tree.link_body,
        body,
        lattice,
        evidence,
        reach.felt,
        contacts,
        touched,
        rings,
        margin,
        position,
        rotation,
        cells,
        owner,
        height,
    )
    # Sorted by patch, with the way each cell's height changes as the joints turn.
    active = _moving(tree, touched)
    cell, above, slope = np.empty(count, dtype=np.int64), np.empty(count), np.empty((len(active), count))
    begin = np.zeros(len(contacts) + 1, dtype=np.int64)
    weight, fall = np.empty(len(contacts)), np.empty(len(contacts))
    linear, angular = np.empty((len(pose), 3)), np.empty((len(pose), 3))
    arm, normal = np.empty(3), np.empty(3)
    ny, nz = lattice.shape[1], lattice.shape[2]
    patches = done = 0
    last = -1
    for patch in range(len(contacts)):
        link = body.patch_link[patch]
        if not contacts[patch]:
            continue
        own = tree.link_body[link]
        turn, at = rotation[own], position[own]
        if link != last:
            twists(tree, pose, position, rotation, own, linear, angular)
            last = link
        for c in range(count):
            if owner[c] != patch:
                continue
            cell[done], above[done] = cells[c], height[c]
            index = cells[c] // (ny * nz), cells[c] // nz % ny, cells[c] % nz
            along = 0.0
            for i in range(3):
                arm[i] = lattice.origin[i] + (index[i] + 0.5) * lattice.resolution - at[i]
                along += arm[i] * turn[i, 2]
            along = min(max(along, 0.0), body.length[link])
            for i in range(3):
                normal[i] = (arm[i] - along * turn[i, 2]) / (height[c] + body.radius[link] + 1e-9)
            for a in range(len(active)):
                moved = _moved(linear[active[a]], angular[active[a]], arm)
                slope[a, done] = -(normal[0] * moved[0] + normal[1] * moved[1] + normal[2] * moved[2])
            done += 1
        if done > begin[patches]:
            weight[patches], fall[patches] = touch[patch], reach.fall[link]
            patches += 1
            begin[patches] = done
    return Suspects(begin[: patches + 1], weight[:patches], fall[:patches], cell, above, slope, active)


@part()
def _moved(linear, angular, arm):
    """How a point `arm` (3,) m from the origin of a frame moves with a twist of it."""
    return (
        linear[0] + angular[1] * arm[2] - angular[2] * arm[1],
        linear[1] + angular[2] * arm[0] - angular[0] * arm[2],
        linear[2] + angular[0] * arm[1] - angular[1] * arm[0],
    )


@part()
def _owner(body, turn, link, dx, dy, dz):
    """The patch of `link`, whose frame is `turn` (3, 3), that is nearest to a point (dx, dy, dz) m from its start."""
    x = turn[0, 0] * dx + turn[1, 0] * dy + turn[2, 0] * dz
    y = turn[0, 1] * dx + turn[1, 1] * dy + turn[2, 1] * dz
    z = turn[0, 2] * dx + turn[1, 2] * dy + turn[2, 2] * dz
    return patch_at(body.first, body.length, body.tip, body.along, body.around, body.rings, link, x, y, z)


@inner()
def sweep(
    link_body,
    body,
    lattice,
    evidence,
    reach,
    contacts,
    rings,
    carve,
    position,
    rotation,
    common,
    least,
    slot,
    seen,
    stale,
    where,
    loses,
    along,
    square,
):
    """What `sweep_free` does, of a hand whose bodies are at `position` (B, 3) and `rotation` (B, 3, 3); returns how
    many of `where` and `loses` are filled. `along` and `square` (Z,) are scratch."""
    kept = 0
    res, origin = lattice.resolution, triple(lattice.origin)
    ny, nz = lattice.shape[1], lattice.shape[2]
    for link in range(len(body.radius)):
        at, turn = triple(position[link_body[link]]), rotation[link_body[link]]
        axis, length, radius = triple(turn[:, 2]), body.length[link], body.radius[link]
        close = radius + evidence.near
        pad = max(close, reach.carved[link]) if carve else close
        low0, high0, low1, high1, low2, high2 = voxel_box(at, axis, length, pad, lattice)
        outer, near, carved = pad * pad, close * close, reach.carved[link] ** 2 if carve else 0.0
        core, felt = max(radius - evidence.deep, 0.0) ** 2, reach.felt[link] ** 2
        per_bin, first = 1.0 / reach.bin[link], (origin[2] - at[2]) / res + 0.5
        touched = any_of(rings[link])
        for i in range(low0, high0):
            dx = origin[0] + (i + 0.5) * res - at[0]
            for j in range(low1, high1):
                dy = origin[1] + (j + 0.5) * res - at[1]
                row = (i * ny + j) * nz
                begin, end = voxel_span(dx, dy, axis, outer, first, res, low2, high2)
                for k in range(begin, end):  # nothing but arithmetic, several voxels at a time
                    along[k], square[k] = from_bone(dx, dy, origin[2] + (k + 0.5) * res - at[2], axis, length)
                for k in range(begin, end):
                    cell = row + k
                    if square[k] < near and not seen[cell]:
                        seen[cell] = stale[cell] = True
                    if square[k] >= carved or common[cell] == least:
                        continue
                    if (
                        touched
                        and core <= square[k] < felt
                        and rings[link, row_at(body.length, body.tip, body.along, link, along[k])]
                        and contacts[_owner(body, turn, link, dx, dy, origin[2] + (k + 0.5) * res - at[2])]
                    ):
                        continue
                    lost = reach.free[link, int(max(square[k], 0.0) * per_bin)]
                    seen[cell] = stale[cell] = True
                    if slot[cell] < 0:
                        common[cell] = max(common[cell] - lost, least)
                    else:
                        where[kept], loses[kept] = slot[cell], lost
                        kept += 1
    return kept


@kernel()
def sweep_free(tree, body, lattice, evidence, reach, stance, contacts, carve, common, slot, seen, stale):
    """Cells inside a link at the `stance` of the mean pose are free, the surer the deeper (`Reach.free`), but for those
    about the skin of a patch that feels contact: if `carve`, they lose log-odds in `common` (V,), down to -LIMIT. Of
    those that particles keep, returns the slots (W,) and what they have to lose (W,); see `lose`.

    `seen` (V,) is set for what lies within `evidence.near` m of the skin, `stale` (V,) for all that changes.
    """
    every = np.empty(len(body.radius), dtype=np.bool_)
    for link in range(len(every)):
        every[link] = True
    most = room(body, lattice, reach.carved, every)
    where, loses = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    kept = sweep(
        tree.link_body,
        body,
        lattice,
        evidence,
        reach,
        contacts,
        ringing(body, contacts),
        carve,
        stance.position,
        stance.rotation,
        common,
        -LIMIT,
        slot,
        seen,
        stale,
        where,
        loses,
        np.empty(lattice.shape[2]),
        np.empty(lattice.shape[2]),
    )
    return where[:kept], loses[:kept]


@kernel()
def lose(where, loses, own):
    """Take `loses` (W,) from the log-odds at the slots `where` (W,) in every particle's map."""
    for n in range(len(own)):
        for w in range(len(where)):
            own[n, where[w]] = max(own[n, where[w]] - loses[w], -LIMIT)


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


@kernel(fastmath=True)
def _share(suspects, where, evidence, delta, own, n, touched, solid, hits, ring):
    """Give the evidence of each touch to the cells that may have caused it, in the map of particle n, whose pose is
    `delta` (J,) rad from the mean. At least one of them is occupied: each gets the log of its noisy-OR likelihood
    ratio given what is known of the others, so that a single suspect gets all of the evidence, and one of many next
    to none. `hits` and `ring` (C,) are scratch."""
    for c in range(len(suspects.cell)):
        hits[c] = suspects.height[c]
    for a in range(len(suspects.active)):
        turned = delta[suspects.active[a]]
        for c in range(len(suspects.cell)):
            hits[c] += suspects.slope[a, c] * turned
    for patch in range(len(suspects.weight)):
        begin, end = suspects.begin[patch], suspects.begin[patch + 1]
        per_fall, weight = 1.0 / suspects.fall[patch], suspects.weight[patch] / QUANTUM
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
            # Of the likelihood, if the cell is occupied rather than free, as a fraction: hits · others / (1 - others).
            gain, rest = hits[c] * clear, ring[c] - clear
            if weight * gain < 0.5 * rest:
                continue  # less than half a quantum
            new = min(own[n, where[c]] + int(weight * np.log(1.0 + gain / rest) + 0.5), LIMIT)
            own[n, where[c]] = new
            if not touched[suspects.cell[c]]:
                touched[suspects.cell[c]] = True
            if new >= evidence.solid and not solid[suspects.cell[c]]:
                solid[suspects.cell[c]] = True


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
        best = least = score[0]
        for c in range(candidates):
            best, least = max(best, score[c]), min(least, score[c])
        total = 0.0
        for c in range(candidates):
            score[c] = np.exp(score[c] - best)
            total += score[c]
        log_mean[n] = best + np.log(total / candidates)
        moved[n] = best - least > np.log(2.0)
        for i in range(joints):
            poses[n, i] = deviations[n, i]
            for h in range(pairs):
                poses[n, i] += (score[2 * h] - score[2 * h + 1]) / total * away[h, i]
        _share(suspects, where, evidence, poses[n], own, n, touched, solid, hits, ring)


@kernel()
def settle(cells, used, kept, common, slot, own, seen, stale):
    """Give each of `cells` (C,) a slot that has none: the first one free is `used`, and `kept` (> T,) lists the cells
    of all slots. Sets `seen` and `stale` (V,); returns the slots (C,) and how many are used now."""
    where = np.empty(len(cells), dtype=np.int64)
    for c in range(len(cells)):
        cell = cells[c]
        seen[cell] = stale[cell] = True
        if slot[cell] < 0:
            kept[used], slot[cell] = cell, used
            for n in range(len(own)):
                own[n, used] = common[cell]
            common[cell] = 0
            used += 1
        where[c] = slot[cell]
    return where, used


@kernel()
def mark(cells, touched, seen, stale):
    """Set `stale` (V,) for those of `cells` (T,) that are `touched` (V,) and `seen` (V,)."""
    for cell in cells:
        stale[cell] |= touched[cell] & seen[cell]


@kernel()
def flagged(flags):
    """Where (C,) `flags` (V,) are set; few are, so that eight are looked at at a time."""
    words = flags[: len(flags) // 8 * 8].view(np.uint64)
    found, count = np.empty(len(flags), dtype=np.int64), 0
    for w in range(len(words)):
        if words[w] == 0:
            continue
        for cell in range(8 * w, 8 * w + 8):
            if flags[cell]:
                found[count] = cell
                count += 1
    for cell in range(8 * len(words), len(flags)):
        if flags[cell]:
            found[count] = cell
            count += 1
    result = np.empty(count, dtype=np.int64)
    for c in range(count):
        result[c] = found[c]
    return result


@kernel()
def spread(cells, shape, told):
    """Let something be told of `cells` (C,) and of the 26 neighbours of each: `told` (V,) int8 is 1 there, 2 for the
    former; `shape` (3,) of the grid. Returns the neighbours (F,) of which nothing was told before."""
    nx, ny, nz = shape
    fresh, count = np.empty(26 * len(cells), dtype=np.int64), 0
    for cell in cells:
        told[cell] = max(told[cell], 1)
    for cell in cells:
        if told[cell] == 2:
            continue
        told[cell] = 2
        x, y, z = cell // (ny * nz), cell // nz % ny, cell % nz
        for i in range(max(x - 1, 0), min(x + 2, nx)):
            for j in range(max(y - 1, 0), min(y + 2, ny)):
                for k in range(max(z - 1, 0), min(z + 2, nz)):
                    other = (i * ny + j) * nz + k
                    if told[other] == 0:
                        told[other] = 1
                        fresh[count] = other
                        count += 1
    return fresh[:count]


@kernel()
def mean_probability(where, own, weights, probability):
    """Posterior probability (C,) of the voxels at the slots `where` (C,): the particles' own, averaged by `weights`
    (N,); `probability` (256,) is that of an entry v at [v + 128]."""
    result = np.zeros(len(where))
    for begin in range(0, len(where), 512):
        end = min(begin + 512, len(where))
        for n in range(own.shape[0]):
            for c in range(begin, end):
                result[c] += weights[n] * probability[own[n, where[c]] + 128]
    return result
