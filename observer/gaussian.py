"""What the observer asks of Gaussians whose covariances may be singular, compiled.

Shapes: J joints.
"""

from __future__ import annotations

import numba
import numpy as np

SMALLEST = 1e-12  # share of a variance below which what is left of it is rounding
JITTER = 1e-12  # rad²


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
def moved_along(deviations, before, after):
    """`deviations` (N, J) from the mean of a Gaussian as it narrows, or widens: of what it was, with the factor
    `before` (J, J), each keeps its place in what it is, with the factor `after` (J, J)."""
    size = len(before)
    result = np.zeros(deviations.shape)
    normal = np.empty(size)
    for n in range(len(deviations)):
        for i in range(size):
            normal[i] = deviations[n, i]
            for k in range(i):
                normal[i] -= before[i, k] * normal[k]
            normal[i] = normal[i] / before[i, i] if before[i, i] > 0.0 else 0.0
        for i in range(size):
            for k in range(i + 1):
                result[n, i] += after[i, k] * normal[k]
    return result


@numba.njit(cache=True)
def regression(covariance, cross):
    """B (M, J) of the best linear guess B·x of y, given the `covariance` (J, J) of x and `cross` (J, M) of x with y."""
    return np.linalg.solve(covariance + JITTER * np.eye(len(covariance)), cross).T
