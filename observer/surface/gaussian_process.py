"""A solid as a function of space, negative inside, drawn from a Gaussian process about a sphere.

Williams & Fitzgibbon 2007 (Gaussian process implicit surfaces); Dragiev, Toussaint & Gienger 2011 (ICRA) with touches.
The covariance is Matérn's with ν = 3/2 (Rasmussen & Williams 2006, eq. 4.17), which lets a surface bend sharply.
Shapes: M places, n observations. Metres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.spatial.distance import cdist

from haptic_env.arrays import Array

AMPLITUDE = 0.020  # m, SD of the surface about the sphere where nothing was felt
LENGTH = 0.047 / np.sqrt(3.0)  # m, over which a touch tells of what is beside it
BLOCK = 256  # places at a time, which the processor's caches hold


class Sphere(NamedTuple):
    """What is expected.

    Attributes:
        centre: (3,) m.
        radius: m.
    """

    centre: Array
    radius: float

    def distance(self, places: Array) -> Array:
        """Measure distances to its surface.

        Args:
            places: (M, 3) m.

        Returns:
            (M,) m, negative inside.
        """
        return np.linalg.norm(places - self.centre, axis=1) - self.radius


class Observations(NamedTuple):
    """What is known of the function.

    Attributes:
        places: (n, 3) m.
        values: (n,) m.
        noise: (n, n) m², covariance of the values' errors.
    """

    places: Array
    values: Array
    noise: Array

    def also(self, places: Array, values: Array, variance: Array) -> Observations:
        """Add observations whose errors are their own.

        Args:
            places: (m, 3) m.
            values: (m,) m.
            variance: (m,) m².

        Returns:
            All of them.
        """
        count, more = len(self.places), len(places)
        noise = np.zeros((count + more, count + more))
        noise[:count, :count] = self.noise
        noise[range(count, count + more), range(count, count + more)] = variance
        return Observations(np.concatenate([self.places, places]), np.concatenate([self.values, values]), noise)


class Field:
    """The process given observations."""

    def __init__(self, expected: Sphere, observed: Observations) -> None:
        """Condition the process.

        Args:
            expected: its mean where nothing was observed.
            observed: what is known of it.
        """
        self._expected, self._places = expected, observed.places
        covariance = _covariance(cdist(observed.places, observed.places)) + observed.noise
        self._factor = cho_factor(covariance, lower=True)
        self._weights = cho_solve(self._factor, observed.values - expected.distance(observed.places))

    @property
    def reach(self) -> tuple[Array, Array]:
        """Corners (3,) m of the box about all observations."""
        return self._places.min(axis=0), self._places.max(axis=0)

    def value(self, places: Array) -> Array:
        """Tell the mean.

        Args:
            places: (M, 3) m.

        Returns:
            (M,) m, negative inside.
        """
        told = [_covariance(cdist(each, self._places)) @ self._weights for each in _blocks(places)]
        return self._expected.distance(places) + np.concatenate(told)

    def gradient(self, places: Array) -> Array:
        """Tell how the mean grows.

        Args:
            places: (M, 3) m.

        Returns:
            (M, 3), out of the solid at its surface.
        """
        told = []
        for each in _blocks(places):
            way = each[:, None] - self._places
            fall = AMPLITUDE**2 / LENGTH**2 * np.exp(-np.linalg.norm(way, axis=2) / LENGTH)
            told.append(-np.einsum("mn,mni->mi", fall * self._weights, way))
        out = places - self._expected.centre
        return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12) + np.concatenate(told)

    def std(self, places: Array) -> Array:
        """Tell how surely the value is known.

        Args:
            places: (M, 3) m.

        Returns:
            (M,) m, SD.
        """
        told = []
        for each in _blocks(places):
            shared = _covariance(cdist(self._places, each))
            told.append((solve_triangular(self._factor[0], shared, lower=True) ** 2).sum(axis=0))
        return np.sqrt(np.maximum(AMPLITUDE**2 - np.concatenate(told), 0.0))


def _covariance(distance: Array) -> Array:
    """Matérn's; `distance` is taken as room for it, as most of the time goes here."""
    distance /= LENGTH
    fall = np.exp(-distance)
    distance += 1.0
    distance *= fall
    distance *= AMPLITUDE**2
    return distance


def _blocks(places: Array) -> list[Array]:
    return np.split(places, range(BLOCK, len(places), BLOCK))
