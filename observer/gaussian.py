"""What the observer asks of Gaussians whose covariances may be singular, compiled.

Shapes: J joints.
"""

from __future__ import annotations

import numba
import numpy as np

SMALLEST = 1e-12  # share of a variance below which what is left of it is rounding
JITTER = 1e-12  # rad²


@numba.njit(cache=True, inline="always")
def add(factor, values, target):
    """target += `factor` · `values`, in place and without an array between: a plain loop, which vectorises."""
    for i in range(len(target)):
        target[i] += factor * values[i]


@numba.njit(cache=True)
def lower_factor(covariance):
    """The Cholesky factor (J, J) of a positive semi-definite `covariance` (J, J): where nothing is left of a variance
    its column is zero."""
    size = len(covariance)
    factor = np.zeros((size, size))
    for j in range(size):
        left = covariance[j, j]
        for k in range(j):
            left -= factor[j, k] * factor[j, k]
        if left <= SMALLEST * covariance[j, j]:
            continue
        factor[j, j] = np.sqrt(left)
        for i in range(j + 1, size):
            each = 0.5 * (covariance[i, j] + covariance[j, i])
            for k in range(j):
                each -= factor[i, k] * factor[j, k]
            factor[i, j] = each / factor[j, j]
    return factor


@numba.njit(cache=True)
def carried(before, after):
    """What (J, J) makes of a deviation from the mean of a Gaussian as it narrows, or widens: in what it was, with the
    factor `before` (J, J), it has the same place as what comes of it has in what it is, with the factor `after`."""
    size = len(before)
    result = np.zeros((size, size))
    normal = np.empty(size)
    for column in range(size):
        for i in range(size):
            normal[i] = 1.0 if i == column else 0.0
            for k in range(i):
                normal[i] -= before[i, k] * normal[k]
            normal[i] = normal[i] / before[i, i] if before[i, i] > 0.0 else 0.0
        for i in range(size):
            for k in range(i + 1):
                result[i, column] += after[i, k] * normal[k]
    return result


@numba.njit(cache=True)
def solved(covariance, cross):
    """The X (J, M) of C·X = `cross` (J, M), C being the `covariance` (J, J) and a hair more, by its Cholesky factor; 0
    for what has no variance of its own."""
    size = len(covariance)
    factor = lower_factor(covariance + JITTER * np.eye(size))
    result = cross.copy()
    for i in range(size):
        for k in range(i):
            add(-factor[i, k], result[k], result[i])
        result[i] *= 1.0 / factor[i, i] if factor[i, i] > 0.0 else 0.0
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            add(-factor[k, i], result[k], result[i])
        result[i] *= 1.0 / factor[i, i] if factor[i, i] > 0.0 else 0.0
    return result


@numba.njit(cache=True)
def conditional(mean, covariance, before, now, size):
    """Of a Gaussian of `mean` (S,) and `covariance` (S, S), how its `size` numbers from `now` on follow from those from
    `before` on: their mean, B, the mean of what is before, and the covariance of what is left."""
    cross = covariance[before : before + size, now : now + size].copy()
    follow = solved(covariance[before : before + size, before : before + size], cross).T.copy()
    rest = covariance[now : now + size, now : now + size] - follow @ cross
    return mean[now : now + size].copy(), follow, mean[before : before + size].copy(), rest


@numba.njit(cache=True)
def carried_on(covariance, before, now, follow, about, factor, points):
    """Where `points` (N, J) about `about` (J,), drawn with the `factor` (J, J), lie from their mean once what they are
    points of, from `before` on in a Gaussian of `covariance` (S, S), has become what is from `now` on, by `follow`
    (J, J); and the factor (J, J) of the latter."""
    size = len(about)
    narrowed = carried(factor, lower_factor(covariance[before : before + size, before : before + size]))
    centres = (points - about) @ (follow @ narrowed).T
    return centres, lower_factor(covariance[now : now + size, now : now + size])


@numba.njit(cache=True)
def shifted(mean, covariance, lagged, shift):
    """Of a Gaussian of `mean` (S,) and `covariance` (S, S): the mean and the SD (J,) of its first J numbers once the J
    from `lagged` on turn out to lie `shift` (J,) from their mean; the same of those; and their covariance (J, J), which
    is that of before."""
    size = len(shift)
    block = covariance[lagged : lagged + size, lagged : lagged + size].copy()
    share = solved(block, shift.reshape(-1, 1))
    angles = mean[:size].copy()
    for i in range(size):
        add(share[i, 0], covariance[lagged + i, :size], angles)
    variance = np.diag(covariance)
    now, then = np.sqrt(variance[:size]), np.sqrt(variance[lagged : lagged + size])
    return angles, now, mean[lagged : lagged + size] + shift, then, block
