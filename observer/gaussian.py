"""What the observer asks of Gaussians whose covariances may be singular, compiled.

Shapes: J joints.
"""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part

SMALLEST = 1e-12  # share of a variance below which what is left of it is rounding
JITTER = 1e-12  # rad²


@part()
def add(factor, values, target):
    """Do target += factor · values, in place and without an array between: a plain loop, which vectorises.

    Args:
        factor: a number.
        values: (M,).
        target: (M,), changed.
    """
    for i in range(len(target)):
        target[i] += factor * values[i]


@part()
def scale(factor, target):
    """Do target *= factor, in place.

    Args:
        factor: a number.
        target: (M,), changed.
    """
    for i in range(len(target)):
        target[i] *= factor


@inner()
def times(a, b, out):
    """Fill out = a · b, without BLAS, whose threads cost such small matrices more than they save.

    Plain loops over rows of b, four at a time, vectorise without reordering sums.

    Args:
        a: (M, K).
        b: (K, L).
        out: (M, L), filled.
    """
    inner_size = a.shape[1]
    for i in range(len(out)):
        row = out[i]
        for j in range(len(row)):
            row[j] = 0.0
        k = 0
        while k + 4 <= inner_size:
            a0, a1, a2, a3 = a[i, k], a[i, k + 1], a[i, k + 2], a[i, k + 3]
            if a0 == 0.0 and a1 == 0.0 and a2 == 0.0 and a3 == 0.0:  # fingers that do not move each other
                k += 4
                continue
            b0, b1, b2, b3 = b[k], b[k + 1], b[k + 2], b[k + 3]
            for j in range(len(row)):
                row[j] += a0 * b0[j] + a1 * b1[j] + a2 * b2[j] + a3 * b3[j]
            k += 4
        while k < inner_size:
            add(a[i, k], b[k], row)
            k += 1


@inner()
def fill(source, target):
    """Copy numbers.

    Args:
        source: (M, K).
        target: (M, K), filled.
    """
    for i in range(len(target)):
        for j in range(target.shape[1]):
            target[i, j] = source[i, j]


@inner()
def factorise(covariance, jitter, factor):
    """Find the Cholesky factor of a covariance that may be singular.

    Args:
        covariance: (J, J), positive semi-definite.
        jitter: what is added to its diagonal.
        factor: (J, J), filled: where nothing is left of a variance its column is zero.
    """
    size = len(covariance)
    for j in range(size):
        for i in range(size):
            factor[i, j] = 0.0
        own = covariance[j, j] + jitter
        left = own
        for k in range(j):
            left -= factor[j, k] * factor[j, k]
        if left <= SMALLEST * own:
            continue
        factor[j, j] = np.sqrt(left)
        for i in range(j + 1, size):
            each = 0.5 * (covariance[i, j] + covariance[j, i])
            for k in range(j):
                each -= factor[i, k] * factor[j, k]
            factor[i, j] = each / factor[j, j]


@kernel()
def lower_factor(covariance):
    """Find the Cholesky factor of a covariance that may be singular.

    Args:
        covariance: (J, J), positive semi-definite.

    Returns:
        (J, J): where nothing is left of a variance its column is zero.
    """
    factor = np.empty(covariance.shape)
    factorise(covariance, 0.0, factor)
    return factor


@inner()
def carried(before, after, normal, result):
    """Find what becomes of deviations from the mean of a Gaussian as it narrows, or widens.

    A deviation has the same place in what the Gaussian was as what comes of it has in what it is: after · before⁻¹.

    Args:
        before: (J, J), lower Cholesky factor of what it was.
        after: (J, J), of what it is.
        normal: (J,), scratch.
        result: (J, J), filled: by which deviations are multiplied.
    """
    size = len(before)
    for column in range(size):
        for i in range(size):
            normal[i] = 1.0 if i == column else 0.0
            for k in range(i):
                normal[i] -= before[i, k] * normal[k]
            normal[i] = normal[i] / before[i, i] if before[i, i] > 0.0 else 0.0
        for i in range(size):
            result[i, column] = 0.0
            for k in range(i + 1):
                result[i, column] += after[i, k] * normal[k]


@inner()
def solve(covariance, factor, result):
    """Solve C·X = B, C being a covariance that may be singular, and a hair more.

    Args:
        covariance: (J, J), positive semi-definite.
        factor: (J, J), filled with its Cholesky factor.
        result: (J, M), B before and X after, 0 for what has no variance of its own.
    """
    size = len(covariance)
    factorise(covariance, JITTER, factor)
    for i in range(size):
        for k in range(i):
            add(-factor[i, k], result[k], result[i])
        scale(1.0 / factor[i, i] if factor[i, i] > 0.0 else 0.0, result[i])
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            add(-factor[k, i], result[k], result[i])
        scale(1.0 / factor[i, i] if factor[i, i] > 0.0 else 0.0, result[i])


@kernel()
def conditional(mean, covariance, before, now, size):
    """Find how some numbers of a Gaussian follow from others.

    Args:
        mean: (S,).
        covariance: (S, S).
        before: index of the first of those that are known.
        now: index of the first of those that follow.
        size: J, of either.

    Returns:
        The mean (J,) of what follows, B (J, J) by which it does, the mean (J,) of what is known, and the covariance
        (J, J) of what is left.
    """
    here, there, follow, rest = np.empty(size), np.empty(size), np.empty((size, size)), np.empty((size, size))
    cross, share, factor = np.empty((size, size)), np.empty((size, size)), np.empty((size, size))
    fill(covariance[before : before + size, now : now + size], cross)
    fill(cross, share)
    solve(covariance[before : before + size, before : before + size], factor, share)
    for i in range(size):
        here[i], there[i] = mean[now + i], mean[before + i]
        for j in range(size):
            follow[i, j] = share[j, i]
    times(follow, cross, rest)
    for i in range(size):
        for j in range(size):
            rest[i, j] = covariance[now + i, now + j] - rest[i, j]
    return here, follow, there, rest


@kernel()
def carried_on(covariance, before, now, follow, about, factor, points):
    """Carry points on from one part of a Gaussian to another.

    Args:
        covariance: (S, S).
        before: index of the first number of what they are points of.
        now: index of the first number of what that becomes.
        follow: (J, J), by which it does.
        about: (J,), the mean about which points were drawn.
        factor: (J, J), with which they were drawn.
        points: (N, J).

    Returns:
        How far (N, J) they lie from the mean of what is from `now` on, and its factor (J, J).
    """
    size = len(about)
    narrow, narrowed, moved = np.empty((size, size)), np.empty((size, size)), np.empty((size, size))
    after, away, centres = np.empty((size, size)), np.empty((1, size)), np.empty(points.shape)
    factorise(covariance[before : before + size, before : before + size], 0.0, narrow)
    carried(factor, narrow, away[0], narrowed)
    times(follow, narrowed, moved)
    for i in range(size):
        for j in range(size):
            narrow[i, j] = moved[j, i]
    for n in range(len(points)):
        for j in range(size):
            away[0, j] = points[n, j] - about[j]
        times(away, narrow, centres[n : n + 1])
    factorise(covariance[now : now + size, now : now + size], 0.0, after)
    return centres, after


@kernel()
def shifted(mean, covariance, lagged, shift):
    """Find what is known of the present once the past turns out to be elsewhere.

    Args:
        mean: (S,), the present being its first J numbers.
        covariance: (S, S).
        lagged: index of the first of the J numbers of the past.
        shift: (J,), how far from its mean the past lies.

    Returns:
        Mean and SD (J,) of the present, the same of the past, and the past's covariance (J, J); the spread is that of
        before.
    """
    size = len(shift)
    block, factor, share = np.empty((size, size)), np.empty((size, size)), np.empty((size, 1))
    angles, now, there, then = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    fill(covariance[lagged : lagged + size, lagged : lagged + size], block)
    for i in range(size):
        share[i, 0] = shift[i]
        angles[i], there[i] = mean[i], mean[lagged + i] + shift[i]
        now[i], then[i] = np.sqrt(covariance[i, i]), np.sqrt(block[i, i])
    solve(block, factor, share)
    for i in range(size):
        add(share[i, 0], covariance[lagged + i, :size], angles)
    return angles, now, there, then, block


def mixture(weights: Array, means: Array, covariances: Array) -> tuple[Array, Array]:
    """Find the moments of K mixtures of M Gaussians.

    Args:
        weights: (K, M).
        means: (K, M, S).
        covariances: (K, M, S, S).

    Returns:
        Mean (K, S) and covariance (K, S, S).
    """
    count, parts, size = means.shape
    mean = (weights[:, None] @ means)[:, 0]
    apart = means - mean[:, None]
    covariance = (weights[:, None] @ covariances.reshape(count, parts, size * size)).reshape(count, size, size)
    covariance += np.swapaxes(weights[..., None] * apart, 1, 2) @ apart
    return mean, covariance
