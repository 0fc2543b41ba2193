"""The cells that links sweep, and what they lose by it.

Shapes: N particles, J joints, L links, P patches, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

import numpy as np

from haptic_env.compiled import inner, kernel
from haptic_env.patches import row_at
from observer.maps.capsules import from_bone, ringing, room, triple, voxel_box, voxel_span
from observer.maps.cells import any_of
from observer.maps.evidence import LIMIT
from observer.maps.suspects import _owner


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
    """Cells inside a link at the `stance` of the mean pose are free, the surer the deeper (`reach.free`), but for those
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
