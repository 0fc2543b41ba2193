"""When a subject stops exploring and answers.

Shapes: M cells, S sigmas, R repeats; n times at which it may answer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from sklearn.isotonic import IsotonicRegression

from haptic_env.arrays import Array

PROBABILITIES = np.linspace(0.0, 1.0, 501)  # among which a bound is looked for


def first_beyond(best: Array, bounds: Array) -> NDArray[np.bool_]:
    """Say when the best name is probable enough for the first time.

    Args:
        best: (n, S, R) probability of the best name; NaN where a repeat is missing.
        bounds: (n, S) at which an answer is given.

    Returns:
        (n, S, R) whether it is given then; at the last time it is, if it was not before.
    """
    reached: NDArray[np.bool_] = best >= bounds[..., None]
    reached[-1] = True
    return reached & (np.cumsum(reached, axis=0) == 1)


def worthwhile(best: Array, seconds: Array, price: float) -> Array:
    """Find how probable the best name must be so that to go on is not worth its price.

    A right answer is worth 1, each second costs `price`. What going on will be worth is a monotone function of the best
    name's probability now, fitted to the repeats of all cells from the last time back to the first (the regression
    method of Longstaff & Schwartz 2001, for the optimal stopping of Drugowitsch et al. 2012).

    Args:
        best: (M, S, R, n) probability of the best name; NaN where a repeat is missing.
        seconds: (n,) s.
        price: per second.

    Returns:
        (n, S) probabilities; above 1: it always goes on; 0 at the last time.
    """
    sigmas, steps = best.shape[1], len(seconds)
    bounds = np.zeros((steps, sigmas))
    for level in range(sigmas):
        courses = best[:, level].reshape(-1, steps)
        courses = courses[~np.isnan(courses).any(axis=1)]
        worth = courses[:, -1]
        for step in range(steps - 2, -1, -1):
            now, later = courses[:, step], worth - price * (seconds[step + 1] - seconds[step])
            going_on = IsotonicRegression(out_of_bounds="clip").fit(now, later).predict
            worth = np.where(now >= going_on(now), now, later)
            on = np.flatnonzero(going_on(PROBABILITIES) - 1e-12 > PROBABILITIES)
            bounds[step, level] = PROBABILITIES[on[-1]] + PROBABILITIES[1] if on.size else 0.0
    return bounds
