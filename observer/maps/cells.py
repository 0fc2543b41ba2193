"""Sets of cells of the maps: which were touched, and what all particles make of them.

Shapes: N particles, J joints, L links, P patches, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

import numpy as np

from haptic_env.compiled import kernel


@kernel()
def settle(cells, used, kept, maps):
    """Give a slot to each cell that has none, and take note that they change.

    Args:
        cells: (C,).
        used: how many slots are taken.
        kept: (> T,) the cells of all slots; those of new ones are written.
        maps: the `ParticleMaps`.

    Returns:
        The slots (C,), and how many are taken now.
    """
    common, slot, own, seen, stale = maps.common, maps.slot, maps.own, maps.seen, maps.stale
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
def mark(cells, maps):
    """Take note that the mean of cells changes.

    Args:
        cells: (T,), of which those that are touched and seen become stale.
        maps: the `ParticleMaps`.
    """
    for cell in cells:
        maps.stale[cell] |= maps.touched[cell] & maps.seen[cell]


@kernel()
def flagged(flags):
    """Find the flags that are set: few are, so that eight are looked at at a time.

    Args:
        flags: (V,).

    Returns:
        (C,) indices.
    """
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
    """Let something be told of cells and of the 26 neighbours of each.

    Args:
        cells: (C,).
        shape: (3,) of the grid.
        told: (V,) int8; becomes 1 at neighbours, 2 at the cells themselves.

    Returns:
        The neighbours (F,) of which nothing was told before.
    """
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
    """Average what particles believe.

    Args:
        where: (C,) slots.
        own: (N, > T) int8, the particles' maps.
        weights: (N,).
        probability: (256,) of a map entry v at [v + 128].

    Returns:
        (C,) posterior probability of the voxels at those slots.
    """
    result = np.zeros(len(where))
    for begin in range(0, len(where), 512):
        end = min(begin + 512, len(where))
        for n in range(own.shape[0]):
            for c in range(begin, end):
                result[c] += weights[n] * probability[own[n, where[c]] + 128]
    return result
