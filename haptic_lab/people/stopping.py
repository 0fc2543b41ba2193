"""When a subject stops exploring and answers.

Shapes: M cells, S sigmas, R repeats, T times, C names; n times at which it may answer.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import softmax
from sklearn.isotonic import IsotonicRegression

from haptic_env.arrays import Array
from haptic_lab.people import evidence

PROBABILITIES = np.linspace(0.0, 1.0, 501)  # among which a bound is looked for
# Times of answers are told apart by these shares of the longest course, and whether it was asked for.
SHARES = np.geomspace(1.0 / 32.0, 1.0, 11)
BINS = len(SHARES) + 1


def bin_of(seconds: ArrayLike, deadline: float, last: float) -> NDArray[np.intp]:
    """Say which times of answers count alike.

    Args:
        seconds: (…) s, of answers.
        deadline: s, when they are asked for.
        last: s, of the longest course.

    Returns:
        (…) their bins, the last of which is of answers that were asked for.
    """
    told = np.asarray(seconds)
    bins = np.searchsorted(last * SHARES, told - evidence.LATE)
    return np.where(told >= deadline - evidence.LATE, BINS - 1, np.minimum(bins, BINS - 2))


def moments(at: Array, deadline: float) -> Array:
    """Say when a subject may answer: not before it has felt anything, and when it is asked.

    Args:
        at: (T,) s, the times of courses, the first 0.
        deadline: s, when it is asked.

    Returns:
        (n,) s, the last of which is the deadline.
    """
    return np.append(at[(at > 0.0) & (at < deadline - evidence.LATE)], deadline)


class Stopping:
    """Explorations of which a subject may stop each when it likes, until it is asked."""

    def __init__(self, held: Array, at: Array, deadline: float) -> None:
        """Take what is held for evidence.

        Args:
            held: (M, S, R, T, C) nats, as `evidence.held` has it.
            at: (T,) s, its times.
            deadline: s, when the answer is asked for.
        """
        self.seconds = moments(at, deadline)
        self._courses, self._at = held, at

    @cached_property
    def held(self) -> Array:
        """(M, n, S, R, C) nats."""
        cells, count = len(self._courses), len(self.seconds)
        told = evidence.asked(self._courses, self._at, np.repeat(np.arange(cells), count), np.tile(self.seconds, cells))
        return told.reshape(cells, count, *told.shape[1:])

    @cached_property
    def best(self) -> Array:
        """(M, n, S, R) probability of the best name."""
        return np.asarray(softmax(self.held, axis=-1).max(axis=-1))

    def bounds(self, stop_at: float, price: float) -> Array:
        """Say how probable the best name must be for an answer.

        Args:
            stop_at: the probability itself; inf: it is not said.
            price: what a second costs; 0: nothing.

        Returns:
            (n, S) probabilities; infinite: it waits until it is asked.
        """
        if price > 0.0:
            return worthwhile(np.moveaxis(self.best, 1, -1), self.seconds, price)
        return np.full((len(self.seconds), self._courses.shape[1]), stop_at)

    def first(self, stop_at: float, price: float, cells: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Say when it answers.

        Args:
            stop_at: as of `bounds`.
            price: likewise.
            cells: (c,) of which cells.

        Returns:
            (c, n, S, R) whether it does at each time.
        """
        bounds = self.bounds(stop_at, price)
        return np.stack([first_beyond(self.best[cell], bounds) for cell in cells])

    def when(self, stop_at: float, price: float, cells: NDArray[np.intp]) -> NDArray[np.intp]:
        """Say when it answers.

        Args:
            stop_at: as of `bounds`.
            price: likewise.
            cells: (c,) of which cells.

        Returns:
            (c, S, R) which of the times that is.
        """
        return self.first(stop_at, price, cells).argmax(axis=1)

    def at(self, when: NDArray[np.intp], cells: NDArray[np.intp]) -> Array:
        """Take what is held at some times.

        Args:
            when: (c, S, R) which of the times.
            cells: (c,) of which cells.

        Returns:
            (c, S, R, C) nats.
        """
        return np.take_along_axis(self.held[cells], when[:, None, ..., None], axis=1)[:, 0]


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
