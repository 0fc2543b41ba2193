"""The one density that every noise model here shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def log_normal(value: NDArray[np.float64], mean: NDArray[np.float64], sd: NDArray[np.float64] | float) -> float:
    """Sum the log density of independent normals; a zero `sd` is a point mass (0 where met, -inf elsewhere).

    Args:
        value: (M,).
        mean: (M,).
        sd: (M,), or one for all.

    Returns:
        The sum.
    """
    deviation = np.broadcast_to(sd, np.shape(value))
    error = np.asarray(value) - mean
    sure = deviation == 0
    if (error[sure] != 0).any():
        return -np.inf
    scaled = error[~sure] / deviation[~sure]
    return float(-0.5 * (scaled**2).sum() - np.log(deviation[~sure]).sum() - 0.5 * np.log(2 * np.pi) * scaled.size)
