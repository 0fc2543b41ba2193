"""Factors of covariances that rounding may have left just short of positive."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def square_root(covariance: Array) -> Array:
    """A factor S (J, J) with S·Sᵀ the nearest positive semi-definite matrix to `covariance` (J, J)."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def lower_factor(covariance: Array) -> Array:
    """The same as a lower triangle (J, J): Cholesky's, up to the signs of its columns."""
    return np.asarray(np.linalg.qr(square_root(covariance).T, mode="r")).T
