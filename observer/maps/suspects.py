"""The cells that a touch may be of, and what each of them gains by it.

Shapes: N particles, J joints, L links, P patches, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import inner, kernel, part
from haptic_env.moved import renamed
from haptic_env.patches import patch_at, row_at
from observer.kinematics import _moved, _moving, twists
from observer.maps.capsules import from_bone, ringing, room, voxel_box, voxel_span
from observer.maps.evidence import LIMIT, QUANTUM
from observer.maps.noisy_or import evidence as evidence_of

__getattr__ = renamed(__name__, {"Suspects": "TouchCauses"})

FARTHEST = 2.5  # SDs beyond the shell, where a cell's part in a touch ends
FADE = np.exp(-0.5 * ((np.arange(256) + 0.5) / 256 * FARTHEST) ** 2)  # of it, by the SDs beyond the shell


class TouchCauses(NamedTuple):
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
def suspects_of(tree, body, lattice, evidence, reach, stance, contacts, touch, margin):
    """The `TouchCauses` of all `contacts` (P,) at the `stance` of the mean pose, `touch` (P,) being the weights of the
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
    return TouchCauses(begin[: patches + 1], weight[:patches], fall[:patches], cell, above, slope, active)


@part()
def _owner(body, turn, link, dx, dy, dz):
    """The patch of `link`, whose frame is `turn` (3, 3), that is nearest to a point (dx, dy, dz) m from its start."""
    x = turn[0, 0] * dx + turn[1, 0] * dy + turn[2, 0] * dz
    y = turn[0, 1] * dx + turn[1, 1] * dy + turn[2, 1] * dz
    z = turn[0, 2] * dx + turn[1, 2] * dy + turn[2, 2] * dz
    return patch_at(body.first, body.length, body.tip, body.along, body.around, body.rings, link, x, y, z)


@kernel(fastmath=True)
def _share(suspects, where, evidence, delta, own, n, touched, solid, hits, ring):
    """Give the evidence of each touch to the cells that may have caused it, in the map of particle n, whose pose is
    `delta` (J,) rad from the mean. `hits` and `ring` (C,) are scratch."""
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
            quanta = evidence_of(hits[c], ring[c], clear, weight, 0.5)
            if quanta == 0.0:
                continue
            new = min(own[n, where[c]] + int(quanta + 0.5), LIMIT)
            own[n, where[c]] = new
            if not touched[suspects.cell[c]]:
                touched[suspects.cell[c]] = True
            if new >= evidence.solid and not solid[suspects.cell[c]]:
                solid[suspects.cell[c]] = True
