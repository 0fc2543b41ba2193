"""What it says of the pose that links touch, or do not touch, a solid that is known: compiled.

Shapes: H hypotheses, J joints, L links, n = F·J angles of F steps in one Gaussian, and L numbers more where what is not
known of the skin lasts. Works in place.
"""

from __future__ import annotations

import math

import numpy as np

from haptic_env.compiled import inner, kernel
from observer.jacobians import point_jacobian
from observer.kinematics import body_frames
from observer.shape.distance_fields import distance_from, way_out
from observer.shape.slopes import loosened

CLEAR = 4.0  # in SDs: a link this far within its bounds says nothing


@kernel()
def take_in(tree, skin, solids, h, touches, gaussian, at, model):
    """Take in that the links that feel contact lie on a hypothesis, and the others not inside it.

    The Gaussian becomes that of the same moments, link by link; the gap of a link is linear in the angles about the
    mean of before, known to a tolerance, and with the probability of a surprise anywhere. What is not known of skin and
    surface, and lasts, may be part of the Gaussian: a number of metres for each link, by which its gap is larger.

    Args:
        tree: the hand's kinematics at that step.
        skin: of the hand.
        solids: the distance fields.
        h: index of the hypothesis.
        touches: (L,) whether each link feels contact; below 0: of whose skin nothing was measured.
        gaussian: mean (n,) rad and covariance (n, n) rad², changed.
        at: indices of the first angle of that step, and of what lasts of the first link; below 0: nothing does.
        model: the `TouchModel`, one tolerance for all.

    Returns:
        Log probability of `touches`, given what the Gaussian was.
    """
    mean, (first, lasting), (tolerance, press, surprise) = gaussian[0], at, model
    told = 0.0
    press = max(press, 0.1 * tolerance)  # else no gap would do
    joints = len(tree.zero)
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    jacobian, row = np.empty((3, joints)), np.empty(joints)
    spot, normal = np.empty(3), np.empty(3)
    angles = mean[first : first + joints].copy()
    body_frames(tree, angles, position, rotation)
    for link in range(len(skin.body)):
        if touches[link] < 0:
            continue
        body = skin.body[link]
        gap = nearest(solids, h, skin, link, (position[body], rotation[body]), spot, normal)
        if gap >= solids.far * solids.scale[h]:
            told += math.log(surprise) if touches[link] else 0.0
            continue
        point_jacobian(tree, angles, position, rotation, body, spot, jacobian)
        for j in range(joints):
            row[j] = normal[0] * jacobian[0, j] + normal[1] * jacobian[1, j] + normal[2] * jacobian[2, j]
            gap += row[j] * (mean[first + j] - angles[j])
        own = lasting + link if lasting >= 0 else -1
        if own >= 0:
            gap += mean[own]
        low, high = (-press, 0.0) if touches[link] else (0.0, np.inf)
        loose = loosened(solids, h, tolerance, spot[0], spot[1], spot[2])
        told += _condition((low - gap, high - gap), row, (first, own), gaussian, loose, surprise)
    return told


@inner()
def nearest(solids, h, skin, link, frame, spot, normal):
    """Find where the skin of a link is nearest to a hypothesis.

    Args:
        solids: the distance fields.
        h: index of the hypothesis.
        skin: of the hand.
        link: index.
        frame: of the link, position (3,) m and rotation (3, 3).
        spot: (3,) m, filled with the place.
        normal: (3,), filled with the way that leads out of the solid there.

    Returns:
        The gap there, m, below 0 inside.
    """
    position, rotation = frame
    least = np.inf
    for k in range(skin.begin[skin.first_bead[link]], skin.begin[skin.first_bead[link + 1]]):
        a, b, c = skin.points[k, 0], skin.points[k, 1], skin.points[k, 2]
        x = position[0] + rotation[0, 0] * a + rotation[0, 1] * b + rotation[0, 2] * c
        y = position[1] + rotation[1, 0] * a + rotation[1, 1] * b + rotation[1, 2] * c
        z = position[2] + rotation[2, 0] * a + rotation[2, 1] * b + rotation[2, 2] * c
        gap = distance_from(solids, h, x, y, z)
        if gap < least:
            least = gap
            spot[0], spot[1], spot[2] = x, y, z
    way_out(solids, h, spot[0], spot[1], spot[2], 0.5 * solids.resolution * solids.scale[h], normal)
    return least


@kernel()
def _condition(bounds, row, at, gaussian, tolerance, surprise):
    """Moments of the Gaussian given that `row` · δ + ε lies between `bounds`, known to `tolerance`; δ: what the angles
    from the first of `at` on differ from their mean by, ε: the number at the second, likewise, 0 where that is below 0
    (for one bound: Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, section 3.9).

    Returns:
        Log probability of that.
    """
    (low, high), (first, own), (mean, covariance) = bounds, at, gaussian
    with_gap = np.zeros(len(mean))
    for i in range(len(mean)):
        if own >= 0:
            with_gap[i] = covariance[i, own]
        for j in range(len(row)):
            with_gap[i] += covariance[i, first + j] * row[j]
    total = tolerance**2
    for j in range(len(row)):
        total += row[j] * with_gap[first + j]
    if own >= 0:
        total += with_gap[own]
    deviation = math.sqrt(total)
    a, b = low / deviation, high / deviation
    if a < -CLEAR and b > CLEAR:
        return 0.0
    most = _below(0.5 * (high - low) / tolerance) - _below(0.5 * (low - high) / tolerance)
    weight = (1.0 - surprise) / most
    share = surprise + weight * (_below(b) - _below(a))
    slope = weight * (_density(a) - _density(b)) / share
    bend = slope**2 - weight * (_moment(a) - _moment(b)) / share
    for i in range(len(mean)):
        mean[i] += slope / deviation * with_gap[i]
        for j in range(len(mean)):
            covariance[i, j] -= bend / total * with_gap[i] * with_gap[j]
    return math.log(share)


@inner()
def _below(x):
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


@inner()
def _density(x):
    return math.exp(-0.5 * x**2) / math.sqrt(2.0 * math.pi)


@inner()
def _moment(x):
    return x * _density(x) if abs(x) < 1e3 else 0.0
