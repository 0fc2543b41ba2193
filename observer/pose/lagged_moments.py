"""Mean and covariance of a state and of the angle at each of the last steps, as far as anybody asks for them.

Shapes: T steps of lag, S = 3 + T numbers: angle, velocity and acceleration now, then the angle 1, 2 … T steps ago; A,
the steps by which two angles of the past may be apart for their covariance to be kept; J joints, C directions (the
joints, and sums and differences of each two), M levels of activity.

A filter that moves on and takes in what is felt needs the covariance of what is now with everything, and of the past
with itself only what is asked for afterwards: for a proposal that of two steps in a row. So it keeps 3·S + (1 + A)·T
numbers in place of S².
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part
from observer.gaussian import add

PRESENT = 3  # numbers of a state now
HALF = np.sqrt(0.5)


class LaggedMoments(NamedTuple):
    """Moments of one Gaussian, or of many, of which each array then has as many.

    Attributes:
        mean: (S,).
        rows: (3, S) covariance of what is now with everything.
        bands: (1 + A, T) of the angle 1 + k steps ago with that a steps before it, at [a, k]; what reaches beyond the
            lag is not used.
    """

    mean: Array
    rows: Array
    bands: Array

    @classmethod
    def zero(cls, many: tuple[int, ...], lag: int, apart: int, wide: int = 1) -> Self:
        """Make room.

        Args:
            many: how many Gaussians, axis by axis.
            lag: T.
            apart: A.
            wide: W, of which the same numbers lie side by side, W of the first number and then W of the second.

        Returns:
            All zero; the last axis W times as long.
        """
        now, past = wide * (PRESENT + lag), wide * lag
        return cls(np.zeros((*many, now)), np.zeros((*many, PRESENT, now)), np.zeros((*many, 1 + apart, past)))


@inner()
def mix(share, parts, about, mixed):
    """Find the moments of a mixture.

    Args:
        share: (M,) of each part.
        parts: the `LaggedMoments` of M Gaussians.
        about: (2, S), scratch.
        mixed: the `LaggedMoments` of the mixture, filled.
    """
    means, rows, bands = parts
    mean, row, band = mixed
    apart, scaled = about
    _clear(mean)
    for k in range(PRESENT):
        _clear(row[k])
    for a in range(len(band)):
        _clear(band[a])
    for n in range(len(share)):
        if share[n] > 0.0:
            add(share[n], means[n], mean)
    for n in range(len(share)):
        if share[n] > 0.0:
            for i in range(len(mean)):
                apart[i] = means[n, i] - mean[i]
                scaled[i] = share[n] * apart[i]
            for k in range(PRESENT):
                _add_both(share[n], rows[n, k], scaled[k], apart, row[k])
            for a in range(len(band)):
                _add_products(share[n], bands[n, a], scaled[PRESENT:], apart[PRESENT + a :], band[a])


@part()
def _clear(target):
    """Fill `target` (M,) with zeros."""
    for i in range(len(target)):
        target[i] = 0.0


@part()
def _add_both(one, first, other, second, target):
    """Do target += one · first + other · second: all (M,)."""
    for i in range(len(target)):
        target[i] = target[i] + one * first[i] + other * second[i]


@part()
def _add_products(factor, values, left, right, target):
    """Do target += factor · values + left · right, as far as the last reaches."""
    for i in range(len(right)):
        target[i] = target[i] + factor * values[i] + left[i] * right[i]


@part()
def _halves(first, second, target):
    """Do target = ½ first + ½ second: all (M,)."""
    for i in range(len(target)):
        target[i] = 0.5 * (first[i] + second[i])


@kernel()
def over_partners(weights, moments, mixed):
    """Find the moments of each joint, whichever other one it moves with (`observer.pose.joint_pairs`).

    Args:
        weights: (J, J) probability of each joint's partners, by row.
        moments: `LaggedMoments` of the C directions.
        mixed: `LaggedMoments` of J, filled.
    """
    mean, rows, bands = moments
    joints, size = len(weights), mean.shape[1]
    pairs = (len(mean) - joints) // 2
    means = np.empty((joints, size))
    row, band = np.empty((joints, *rows.shape[1:])), np.empty((joints, *bands.shape[1:]))
    about = np.empty((2, size))
    for j in range(joints):
        for h in range(joints):
            first, second = min(j, h), max(j, h)
            plus = j if h == j else joints + first * (2 * joints - first - 1) // 2 + second - first - 1
            minus = j if h == j else plus + pairs
            sign = 1.0 if j == first else -1.0
            for i in range(size):
                means[h, i] = mean[j, i] if h == j else HALF * (mean[plus, i] + sign * mean[minus, i])
            for k in range(PRESENT):
                _halves(rows[plus, k], rows[minus, k], row[h, k])
            for a in range(band.shape[1]):
                _halves(bands[plus, a], bands[minus, a], band[h, a])
        parts = LaggedMoments(means, row, band)
        mix(weights[j], parts, about, LaggedMoments(mixed.mean[j], mixed.rows[j], mixed.bands[j]))


@kernel()
def spread_out(joints, lasting, mean, covariance):
    """Tell the moments of joints that are independent of each other as one Gaussian.

    Args:
        joints: the `LaggedMoments` of J.
        lasting: (1 + T, J) rad², what angles have in common beside that, by the steps between them.
        mean: (S·J,), filled: one number of the state of all joints after the other.
        covariance: (S·J, S·J): what is kept is filled in.
    """
    means, rows, bands = joints
    count, size = means.shape
    for j in range(count):
        for i in range(size):
            mean[i * count + j] = means[j, i]
        for k in range(PRESENT):
            for i in range(size):
                value = rows[j, k, i] if i >= PRESENT else 0.5 * (rows[j, k, i] + rows[j, i, k])
                if k == 0 and i == 0:
                    value += lasting[0, j]
                elif k == 0 and i >= PRESENT:
                    value += lasting[i - PRESENT + 1, j]
                covariance[k * count + j, i * count + j] = value
                covariance[i * count + j, k * count + j] = value
        for a in range(bands.shape[1]):
            for k in range(bands.shape[2] - a):
                value = bands[j, a, k] + lasting[a, j]
                first, second = (PRESENT + k) * count + j, (PRESENT + k + a) * count + j
                covariance[first, second] = value
                covariance[second, first] = value


def no_covariance(joints: int, lag: int, apart: int) -> Array:
    """Give what `spread_out` fills.

    Args:
        joints: J.
        lag: T.
        apart: A.

    Returns:
        (S·J, S·J): 0 between joints, which are independent, and what will be filled; NaN what of a joint is not kept.
    """
    size = PRESENT + lag
    ago = np.arange(size) - PRESENT
    kept = (ago < 0) | (ago[:, None] < 0) | (abs(ago - ago[:, None]) <= apart)
    covariance = np.zeros((size * joints, size * joints))
    each = np.arange(joints)
    covariance.reshape(size, joints, size, joints)[:, each, :, each] = np.where(kept, 0.0, np.nan)
    return covariance
