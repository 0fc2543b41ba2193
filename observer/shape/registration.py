"""Where a solid would have to lie to be what was touched: registration of touches to its surface, compiled.

Shapes: S starts, N patches that touch, M points of them, U links' looks, B balls of flesh. Lengths in metres.

Touches lie on the surface, balls of flesh outside of it. What departs from that is made least by Levenberg and
Marquardt's steps in size, place and turn, down the slopes of the solid's distance field: of a sample of what was felt
its square, which draws from afar; of all of it what the likelihood (`observer.shape.contact_likelihood`) has to say.

References:
    Fitzgibbon 2003, Image Vision Comput. 21, 1145-1153 (on a distance field); Besl & McKay 1992, IEEE PAMI 14, 239-256.
    Jaakkola & Jordan 2000, Stat. Comput. 10, 25-37 (a parabola that touches the logistic's log and lies beyond it).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part
from observer.shape.contact_likelihood import CLEAR
from observer.shape.distance_fields import box_of
from observer.shape.slopes import gap_from, loosened, way_from

UNKNOWNS = 7  # log size, place, and a small turn about each axis of the world
FIRST_DAMPING = 1e-2
OUTLIER = 0.006  # m: a touch so far away pulls no more than in proportion to its distance
FURTHEST = 0.02, 0.5  # m and rad, at most in one step
STEEP = 1.7  # of the logistic that is nearly a normal's distribution function


class Touched(NamedTuple):
    """What was felt where, in the world.

    Attributes:
        points: (M, 3) m, of skin.
        begin: (N + 1,) those of patch n, which felt contact, are `begin[n]` up to `begin[n + 1]`.
        weight: (N,) exponents of what patches say.
        tolerance: (N,) m, SDs of their gaps.
        balls: (B, 3) m, middles of balls of flesh.
        radius: (B,) m.
        first: (U + 1,) those of a look are `first[u]` up to `first[u + 1]`.
        ball: (U, 4) m, middle and radius of a ball about all of a look's.
        cost: (U,) exponents of what looks say.
        slack: (U,) m, SDs of their gaps.
        deep: (U,) m, how deep flesh may lie: a link that feels contact presses.
        surprise: probability of what the model cannot explain; 0: squares of gaps are what is to be explained, however
            improbable.
    """

    points: Array
    begin: NDArray[np.int64]
    weight: Array
    tolerance: Array
    balls: Array
    radius: Array
    first: NDArray[np.int64]
    ball: Array
    cost: Array
    slack: Array
    deep: Array
    surprise: float

    def sparse(self, patches: int, looks: int) -> Touched:
        """Choose some of what was felt, evenly spaced.

        Args:
            patches: at most, each by the middle one of its points.
            looks: at most, each by its first ball.

        Returns:
            Those.
        """
        n, u = _spaced(len(self.weight), patches), _spaced(len(self.cost), looks)
        return self._replace(
            points=self.points[(self.begin[n] + self.begin[n + 1]) // 2],
            begin=np.arange(len(n) + 1),
            first=np.arange(len(u) + 1),
            **{each: getattr(self, each)[n] for each in ("weight", "tolerance")},
            **{each: getattr(self, each)[self.first[u]] for each in ("balls", "radius")},
            **{each: getattr(self, each)[u] for each in ("ball", "cost", "slack", "deep")},
        )


def _spaced(count: int, most: int) -> NDArray[np.int64]:
    return np.arange(count) if count <= most else np.linspace(0, count - 1, most).astype(np.int64)


class Ranges(NamedTuple):
    """What a solid may be.

    Attributes:
        scale: the least and the largest.
        low: (3,) m, of its place.
        high: (3,) m.
        turns: whether it may be turned.
    """

    scale: tuple[float, float]
    low: Array
    high: Array
    turns: bool


@part()
def _add(weight, off, gap, slope, arm, equations):
    """Add a residual `off` m, which changes as a gap with `slope` (3,) at `arm` (3,) from the middle, to the normal
    equations (7, 7) and (7,)."""
    rx, ry, rz = arm
    normal, right = equations
    row = (
        gap - slope[0] * rx - slope[1] * ry - slope[2] * rz,
        -slope[0],
        -slope[1],
        -slope[2],
        -(ry * slope[2] - rz * slope[1]),
        -(rz * slope[0] - rx * slope[2]),
        -(rx * slope[1] - ry * slope[0]),
    )
    for i in range(UNKNOWNS):
        right[i] -= weight * row[i] * off
        for j in range(i + 1):
            normal[i, j] += weight * row[i] * row[j]


@part()
def _pull(gap, tolerance, weight, surprise):
    """What of a touch is left to be explained, and the weight of the square of its gap."""
    if surprise <= 0.0:
        size, weight = abs(gap), weight / tolerance**2
        if size < OUTLIER:
            return weight * size * size, weight
        return weight * OUTLIER * (2.0 * size - OUTLIER), weight * OUTLIER / size
    ratio = gap / tolerance
    fit = (1.0 - surprise) * math.exp(-0.5 * ratio * ratio) if abs(ratio) < CLEAR else 0.0
    return -2.0 * weight * math.log(surprise + fit), weight * fit / ((surprise + fit) * tolerance**2)


@part()
def _push(gap, tolerance, deep, weight, surprise):
    """What of silence is left to be explained, the weight of a square, and of what it is the square."""
    if surprise <= 0.0:
        off = min(gap + tolerance, 0.0)
        size, weight = -off, weight / tolerance**2
        if size < OUTLIER:
            return weight * size * size, weight, off
        return weight * OUTLIER * (2.0 * size - OUTLIER), weight * OUTLIER / size, off
    x = -STEEP * (gap + deep) / tolerance
    if x < -STEEP * CLEAR:
        return 0.0, 0.0, 0.0
    inside = 1.0 / (1.0 + math.exp(-x)) if x > -30.0 else 0.0
    clear = surprise + (1.0 - surprise) * (1.0 - inside)
    bend = 0.125 if abs(x) < 1e-3 else (inside - 0.5) / (2.0 * x)
    square = 2.0 * weight * bend * (STEEP / tolerance) ** 2
    slope = -2.0 * weight * (1.0 - surprise) * inside * (1.0 - inside) / clear * STEEP / tolerance
    return -2.0 * weight * math.log(clear), square, 0.5 * slope / square


@inner()
def _equations(solids, s, touched, normal, right):
    """Fill the normal equations (7, 7), their lower triangle, and (7,); returns what is to be made least."""
    total = 0.0
    for i in range(UNKNOWNS):
        right[i] = 0.0
        for j in range(UNKNOWNS):
            normal[i, j] = 0.0
    at, box, exact = solids.position[s], box_of(solids, solids.drawn_in[s]), solids.exact[solids.drawn_in[s]]
    for n in range(len(touched.weight)):
        nearest, least = touched.begin[n], np.inf
        for k in range(touched.begin[n], touched.begin[n + 1]):
            gap = gap_from(solids, s, box, touched.points[k, 0], touched.points[k, 1], touched.points[k, 2])
            if gap < least:
                nearest, least = k, gap
        x, y, z = touched.points[nearest, 0], touched.points[nearest, 1], touched.points[nearest, 2]
        tolerance = loosened(solids, s, touched.tolerance[n], x, y, z)
        cost, weight = _pull(least, tolerance, touched.weight[n], touched.surprise)
        total += cost
        if weight > 0.0:
            slope = way_from(solids, s, box, x, y, z)
            _add(weight, least, least, slope, (x - at[0], y - at[1], z - at[2]), (normal, right))
    for u in range(len(touched.cost)):
        begin, end, clear = touched.first[u], touched.first[u + 1], CLEAR * touched.slack[u]
        x, y, z = touched.ball[u, 0], touched.ball[u, 1], touched.ball[u, 2]
        if end > begin + 1 and gap_from(solids, s, box, x, y, z) > touched.ball[u, 3] + clear:
            continue
        deepest, least = begin, np.inf
        for k in range(begin, end):
            radius = touched.radius[k] if exact else 0.0  # where the surface is not known, nothing lies inside of it
            gap = gap_from(solids, s, box, touched.balls[k, 0], touched.balls[k, 1], touched.balls[k, 2]) - radius
            if gap < least:
                deepest, least = k, gap
        x, y, z = touched.balls[deepest, 0], touched.balls[deepest, 1], touched.balls[deepest, 2]
        slack, much = loosened(solids, s, touched.slack[u], x, y, z), touched.cost[u]
        much *= (touched.slack[u] / slack) ** 2 if touched.surprise > 0.0 else 1.0
        cost, weight, off = _push(least, slack, touched.deep[u], much, touched.surprise)
        total += cost
        if cost > 0.0:
            slope, gap = way_from(solids, s, box, x, y, z), gap_from(solids, s, box, x, y, z)
            _add(weight, off, gap, slope, (x - at[0], y - at[1], z - at[2]), (normal, right))
    return total


@inner()
def _solve(normal, right, damping, free, factor, step):
    """Fill `step` (7,) by Cholesky's factor; what is not `free` (7,) stays."""
    for i in range(UNKNOWNS):
        for j in range(i + 1):
            value = normal[i, j] if free[i] and free[j] else 0.0
            if i == j:
                value = value * (1.0 + damping) + 1e-9 if free[i] else 1.0
            for k in range(j):
                value -= factor[i, k] * factor[j, k]
            if i == j:
                factor[i, i] = math.sqrt(max(value, 1e-12))
            else:
                factor[i, j] = value / factor[j, j]
    for i in range(UNKNOWNS):
        value = right[i] if free[i] else 0.0
        for k in range(i):
            value -= factor[i, k] * step[k]
        step[i] = value / factor[i, i]
    for i in range(UNKNOWNS - 1, -1, -1):
        value = step[i]
        for k in range(i + 1, UNKNOWNS):
            value -= factor[k, i] * step[k]
        step[i] = value / factor[i, i]


@inner()
def _moved(solids, s, scale, place, turn, step, ranges):
    """Put start `s` a step (7,) away from where it was: within its ranges, and no step too far."""
    smallest, largest = ranges.scale
    solids.scale[s] = min(max(scale * math.exp(min(max(step[0], -0.1), 0.1)), smallest), largest)
    length = math.sqrt(step[1] ** 2 + step[2] ** 2 + step[3] ** 2)
    share = min(1.0, FURTHEST[0] / max(length, 1e-12))
    for i in range(3):
        solids.position[s, i] = min(max(place[i] + share * step[1 + i], ranges.low[i]), ranges.high[i])
    angle = math.sqrt(step[4] ** 2 + step[5] ** 2 + step[6] ** 2)
    if angle < 1e-12:
        for i in range(3):
            for j in range(3):
                solids.rotation[s, i, j] = turn[i, j]
        return
    x, y, z = step[4] / angle, step[5] / angle, step[6] / angle
    angle = min(angle, FURTHEST[1])
    sine, versine = math.sin(angle), 1.0 - math.cos(angle)
    for j in range(3):
        a, b, c = turn[0, j], turn[1, j], turn[2, j]
        along = x * a + y * b + z * c
        # Rodrigues' formula: v + sin k×v + (1 - cos) k×(k×v).
        solids.rotation[s, 0, j] = a + sine * (y * c - z * b) + versine * (x * along - a)
        solids.rotation[s, 1, j] = b + sine * (z * a - x * c) + versine * (y * along - b)
        solids.rotation[s, 2, j] = c + sine * (x * b - y * a) + versine * (z * along - c)


@kernel()
def register(solids, touched, ranges, steps, cost, information):
    """Move starts to where they explain touches.

    Args:
        solids: of S starts; scale, position and rotation are changed.
        touched: the `Touched`.
        ranges: the `Ranges`.
        steps: at most.
        cost: (S,) filled with what is left to be explained, half of which is a negative log likelihood.
        information: (S, 7, 7) filled with the normal equations there.
    """
    right, step = np.empty(UNKNOWNS), np.zeros(UNKNOWNS)
    normal, trial = np.empty((UNKNOWNS, UNKNOWNS)), np.empty((UNKNOWNS, UNKNOWNS))
    factor, wrong = np.empty((UNKNOWNS, UNKNOWNS)), np.empty(UNKNOWNS)
    free = np.ones(UNKNOWNS, dtype=np.bool_)
    free[0] = ranges.scale[0] < ranges.scale[1]
    for i in range(3):
        free[1 + i] = ranges.low[i] < ranges.high[i]
        free[4 + i] = ranges.turns
    for s in range(len(cost)):
        damping = FIRST_DAMPING
        best = _equations(solids, s, touched, normal, right)
        for _ in range(steps):
            scale, place, turn = solids.scale[s], solids.position[s].copy(), solids.rotation[s].copy()
            _solve(normal, right, damping, free, factor, step)
            _moved(solids, s, scale, place, turn, step, ranges)
            total = _equations(solids, s, touched, trial, wrong)
            if total < best:
                gained, best, damping = best - total, total, max(0.2 * damping, 1e-6)
                normal[:], right[:] = trial, wrong
                if gained < 1e-3 * best + 1e-3:
                    break
            else:
                solids.scale[s], solids.position[s], solids.rotation[s] = scale, place, turn
                damping *= 8.0
                if damping > 1e4:
                    break
        cost[s] = best
        for i in range(UNKNOWNS):
            for j in range(UNKNOWNS):
                information[s, i, j] = normal[max(i, j), min(i, j)]
