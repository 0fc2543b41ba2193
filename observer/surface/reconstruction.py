"""From touches and sweeps to a surface.

A patch that was touched says that one point of its skin lies on the surface, and which one, it does not say: the point
that is deepest in the solid as it is known so far is taken, the solid fitted again, and so on, as iterated closest
points do (Besl & McKay 1992). The finger is a ball on its bone there that touches the solid from outside, so that the
surface turns its face to it, and a little way into the finger the distance from the surface is that way. Both are known
as badly as the finger's place is, and with the same error. What fingers swept may not lie inside.

Shapes: M points of the skin, E touches, n observations, V voxels. Metres, in the frame of the grid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from observer.surface.gaussian_process import AMPLITUDE, Field, Observations, Sphere
from observer.surface.touches import TouchedSkin

ROUNDS = 4  # of choosing the points and fitting the solid; no touch moves by more than a millimetre then
USUAL_RADIUS, RADIUS_STD = 0.025, 0.006  # m, of what hands of this size explore
AWAY_STD = 0.020  # m, of its centre from the middle of the map
ROUGH = 0.0008  # m, SD of a touch beside the pose's: skin gives, and points of the skin lie apart
IN_QUESTION = 0.006  # m above the deepest point of a patch, what may still be it in another round
MERGED = 0.004  # m, edge of cubes in which touches become one
INWARD = 0.008  # m, how far into the finger the distance is known; no bone is further from its skin
TURN_STD = 0.0006  # m, of that, as another point of the patch may have touched
FREE, SWEPT_STD = 0.01, 0.002  # occupancy below which a voxel was surely swept; m, how surely its middle is outside
MOST_SWEPT = 300  # voxels that are pushed out


class _Contact(NamedTuple):
    """Where each of E touches was, its `normal` into the finger's skin outwards, and its `variance` along it."""

    place: Array
    normal: Array
    variance: Array


def reconstruct(skin: TouchedSkin, occupancy: Array, grid: Grid) -> tuple[Field, Sphere]:
    """Fit a solid to all that was felt.

    Args:
        skin: of E touches, one at least.
        occupancy: (X, Y, Z) probabilities.
        grid: of those.

    Returns:
        The solid as a function of space, and the sphere about which it was drawn.
    """
    depth = np.linalg.norm(skin.points - np.median(skin.points, axis=0), axis=1)
    sphere = Sphere(np.median(skin.points, axis=0), USUAL_RADIUS)
    for turn in range(ROUNDS):
        contact = _deepest(skin, depth)
        if turn < ROUNDS - 1:
            sphere = _about(contact, sphere, grid.centre)
        observed = _observations(contact)
        field = Field(sphere, observed)
        depth = field.value(skin.points)
        if turn == 0:
            skin, depth = _nearest(skin, depth)
    return _carved(field, sphere, observed, occupancy, grid), sphere


def _nearest(skin: TouchedSkin, value: Array) -> tuple[TouchedSkin, Array]:
    """Of each touch the points that may turn out to be the deepest, and their values."""
    least = np.repeat(np.minimum.reduceat(value, skin.begin), np.diff([*skin.begin, len(value)]))
    kept = value <= least + IN_QUESTION
    begin = np.concatenate([[0], np.cumsum(np.add.reduceat(kept.astype(np.int64), skin.begin))[:-1]])
    return TouchedSkin(skin.points[kept], skin.normals[kept], skin.variance[kept], begin, skin.alike), value[kept]


def _deepest(skin: TouchedSkin, value: Array) -> _Contact:
    """Of each touch the point of least `value` (M,)."""
    touch = np.repeat(np.arange(len(skin.begin)), np.diff([*skin.begin, len(value)]))
    chosen = np.lexsort((value, touch))[skin.begin]
    variance = skin.alike * (skin.variance[chosen] + ROUGH**2)
    return _Contact(skin.points[chosen], skin.normals[chosen], variance)


def _about(contact: _Contact, start: Sphere, middle: Array) -> Sphere:
    """The most probable sphere through touches from which the surface differs by `AMPLITUDE`."""
    spread = np.sqrt((contact.variance + AMPLITUDE**2) * (1.0 + len(contact.place) / 20.0))  # they lie side by side

    def misfit(told: Array) -> Array:
        return np.concatenate(
            [
                Sphere(told[:3], told[3]).distance(contact.place) / spread,
                (told[:3] - middle) / AWAY_STD,
                [(told[3] - USUAL_RADIUS) / RADIUS_STD],
            ]
        )

    found = least_squares(misfit, np.append(start.centre, start.radius)).x
    return Sphere(found[:3], max(float(found[3]), 0.2 * USUAL_RADIUS))


def _observations(contact: _Contact) -> Observations:
    """Touches of one neighbourhood become one, by their precision; and what they say of the space in the finger."""
    _, which = np.unique(np.floor(contact.place / MERGED).astype(np.int64), axis=0, return_inverse=True)
    which = which.reshape(-1)
    precision = 1.0 / contact.variance
    total = np.bincount(which, precision)

    def mean(each: Array) -> Array:
        return np.stack([np.bincount(which, precision * part) for part in each.T], axis=1) / total[:, None]

    place, normal, variance = mean(contact.place), mean(contact.normal), 1.0 / total
    length = np.linalg.norm(normal, axis=1)
    turned = np.flatnonzero(length > 0.5)  # from which a common direction can be told
    inward = place[turned] - INWARD * normal[turned] / length[turned, None]
    count = len(place)
    noise = np.diag(np.concatenate([variance, variance[turned] + TURN_STD**2]))
    noise[turned, count + np.arange(len(turned))] = variance[turned]
    noise[count + np.arange(len(turned)), turned] = variance[turned]
    values = np.concatenate([np.zeros(count), np.full(len(turned), INWARD)])
    return Observations(np.concatenate([place, inward]), values, noise)


def _carved(field: Field, sphere: Sphere, observed: Observations, occupancy: Array, grid: Grid) -> Field:
    """Push out what was swept."""
    swept = grid.centres()[occupancy < FREE]
    if not len(swept):
        return field
    value = field.value(swept)
    wrong = np.flatnonzero(value < 0.0)
    if not len(wrong):
        return field
    wrong = wrong[np.argsort(value[wrong])[:MOST_SWEPT]]
    values = np.full(len(wrong), 0.5 * SWEPT_STD)
    return Field(sphere, observed.also(swept[wrong], values, np.full(len(wrong), SWEPT_STD**2)))
