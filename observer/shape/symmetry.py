"""By which turns a solid looks the same: each mode of its place has so many copies, and evidence is the sum of all.

Shapes: G turns, N points. Quaternions are xyzw.
"""

from __future__ import annotations

import functools

import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

from haptic_env.arrays import Array
from observer.shape.distance_fields import Solids

FOLDS = 3, 5, 8  # of an axis, besides those of a cube
POINTS, FIRST_POINTS = 400, 20  # and those that exclude most turns
NEAR = 1.5  # nodes of the field, from the surface
SAME, SAME_MOST = 0.0004, 0.001  # m, by which 95 % of distances may differ, and all
MOST, OF_ROUND = 24, 8  # turns; of more than that a solid is round, and few are enough


@functools.cache
def _candidates() -> Rotation:
    """Turns of a cube, and about each axis by parts of a whole turn; that by nothing is the first."""
    cube = Rotation.create_group("O")
    about = [Rotation.create_group(f"C{fold}", axis=axis)[1:] for fold in FOLDS for axis in "XYZ"]
    flips = [turn * flip for turn in about for flip in Rotation.create_group("D2")[1:]]
    every = Rotation.concatenate([cube, *about, *flips])
    order = np.argsort(every.magnitude(), kind="stable")
    kept: list[int] = []
    for i in order:
        if not kept or (every[kept].inv() * every[int(i)]).magnitude().min() > 1e-6:
            kept.append(int(i))
    return every[kept]


def symmetries(solids: Solids, solid: int) -> Array:
    """Find turns about the middle of its bounding box, in its own frame, by which a solid looks the same.

    Those of a prism of three, five or seven sides go about another place, and all but two of them are not found. What
    was felt, here surely and there hardly, is taken to have none but that by nothing.

    Args:
        solids: tables.
        solid: index.

    Returns:
        (G, 4), that by nothing the first.
    """
    f = int(solids.drawn_in[solid])
    field, low, step = solids.field(f), solids.low[f], solids.resolution
    near, candidates = np.argwhere(np.abs(field) < NEAR * step), _candidates()
    if not len(near) or solids.spread[f] >= 0:  # of what was hardly felt, or not alike all around
        return np.asarray(candidates[:1].as_quat())
    rng = np.random.default_rng(0)
    at = near[rng.permutation(len(near))[:POINTS]]
    points = low + step * at
    told = field[tuple(at.T)]
    turns = candidates.as_matrix()
    kept = np.arange(len(turns))
    for few in (slice(FIRST_POINTS), slice(None)):
        there = (np.einsum("gij,nj->ign", turns[kept], points[few]) - low[:, None, None]) / step
        off = np.abs(ndimage.map_coordinates(field, there, order=1, cval=1.0) - told[few])
        same = off.max(axis=1) < SAME_MOST
        if few.stop is None:
            same &= np.quantile(off, 0.95, axis=1) < SAME
        same[0] = True
        kept = kept[same]
    every = 1 if len(kept) <= MOST else len(kept) // OF_ROUND
    return np.asarray(candidates[kept[::every]].as_quat())
