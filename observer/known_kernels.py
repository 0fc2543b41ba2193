"""What it says of the pose that links touch, or do not touch, a solid that is known: compiled.

Shapes: H hypotheses, J joints, L links, n = F·J angles of F steps in one Gaussian. Works in place.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from observer.compiled import inner
from observer.kinematics import body_frames, point_jacobian
from observer.solid_fields import field_distance

CLEAR = 4.0  # in SDs: a link this far on its own side of the surface says nothing


@numba.njit(cache=True, error_model="numpy")
def take_in(tree, skin, solids, h, touches, first, mean, covariance, tolerance, surprise):
    """Take in that the links in `touches` (L,) do not lie outside hypothesis `h`, nor the others inside.

    `mean` (n,) rad and `covariance` (n, n), with the angles of that step from `first` on, become those of the Gaussian
    of the same moments, link by link; the gap of a link is linear in the angles about the mean of before, known to
    `tolerance` m, and with probability `surprise` on the wrong side.
    """
    joints = len(tree.zero)
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    jacobian, row = np.empty((3, joints)), np.empty(joints)
    spot, normal = np.empty(3), np.empty(3)
    angles = mean[first : first + joints].copy()
    body_frames(tree, angles, position, rotation)
    for link in range(len(skin.body)):
        body = skin.body[link]
        gap = nearest(solids, h, skin, link, position[body], rotation[body], spot, normal)
        if gap >= solids.far * solids.scale[h]:
            continue
        point_jacobian(tree, angles, position, rotation, body, spot, jacobian)
        for j in range(joints):
            row[j] = normal[0] * jacobian[0, j] + normal[1] * jacobian[1, j] + normal[2] * jacobian[2, j]
            gap += row[j] * (mean[first + j] - angles[j])
        _condition(-1.0 if touches[link] else 1.0, gap, row, first, mean, covariance, tolerance**2, surprise)


@inner(error_model="numpy")
def nearest(solids, h, skin, link, position, rotation, spot, normal):
    """Gap (m) between hypothesis `h` and the skin of `link`, at `position` (3,) and `rotation` (3, 3); fills `spot`
    (3,) m, where it is least, and `normal` (3,), the way that leads out of the solid there."""
    least = np.inf
    for k in range(skin.begin[skin.first_bead[link]], skin.begin[skin.first_bead[link + 1]]):
        a, b, c = skin.points[k, 0], skin.points[k, 1], skin.points[k, 2]
        x = position[0] + rotation[0, 0] * a + rotation[0, 1] * b + rotation[0, 2] * c
        y = position[1] + rotation[1, 0] * a + rotation[1, 1] * b + rotation[1, 2] * c
        z = position[2] + rotation[2, 0] * a + rotation[2, 1] * b + rotation[2, 2] * c
        gap = _gap(solids, h, x, y, z)
        if gap < least:
            least = gap
            spot[0], spot[1], spot[2] = x, y, z
    x, y, z = spot
    by = 0.5 * solids.resolution * solids.scale[h]
    normal[0] = _gap(solids, h, x + by, y, z) - _gap(solids, h, x - by, y, z)
    normal[1] = _gap(solids, h, x, y + by, z) - _gap(solids, h, x, y - by, z)
    normal[2] = _gap(solids, h, x, y, z + by) - _gap(solids, h, x, y, z - by)
    length = math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    for i in range(3):
        normal[i] /= max(length, 1e-12)
    return least


@inner(inline="always", error_model="numpy")
def _gap(solids, h, x, y, z):
    at, turn, scale = solids.position[h], solids.rotation[h], solids.scale[h]
    x, y, z = (x - at[0]) / scale, (y - at[1]) / scale, (z - at[2]) / scale
    return scale * field_distance(
        solids.field[solids.drawn_in[h]],
        solids.resolution,
        solids.half,
        solids.far,
        turn[0, 0] * x + turn[1, 0] * y + turn[2, 0] * z,
        turn[0, 1] * x + turn[1, 1] * y + turn[2, 1] * z,
        turn[0, 2] * x + turn[1, 2] * y + turn[2, 2] * z,
    )


@numba.njit(cache=True, error_model="numpy")
def _condition(side, gap, row, first, mean, covariance, variance, surprise):
    """Moments of the Gaussian given that `side` · (`gap` + `row` · δ) > 0, δ being what the angles from `first` on
    differ from their mean (Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, section 3.9)."""
    with_gap = np.zeros(len(mean))
    for i in range(len(mean)):
        for j in range(len(row)):
            with_gap[i] += covariance[i, first + j] * row[j]
    total = variance
    for j in range(len(row)):
        total += row[j] * with_gap[first + j]
    deviation = math.sqrt(total)
    ratio = side * gap / deviation
    if ratio > CLEAR:
        return
    density = (1.0 - 2.0 * surprise) * math.exp(-0.5 * ratio**2) / math.sqrt(2.0 * math.pi)
    share = surprise + (1.0 - 2.0 * surprise) * 0.5 * math.erfc(-ratio / math.sqrt(2.0))
    slope = density / share
    bend = slope * (slope + ratio) / total
    for i in range(len(mean)):
        mean[i] += side * slope / deviation * with_gap[i]
        for j in range(len(mean)):
            covariance[i, j] -= bend * with_gap[i] * with_gap[j]
