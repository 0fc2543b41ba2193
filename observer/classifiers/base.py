"""What a classifier of maps is: scikit-learn's own names, one map at a time.

Shapes: M maps, C classes, (X, Y, Z) voxels. A map is an occupancy: the probability of each voxel, 0.5 where unknown.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logit

from haptic_env import readable, validate
from haptic_env.arrays import Array

UNKNOWN = 0.5  # what a map says of a voxel that the hand never came near
CERTAIN = 0.001, 0.999  # evidence beyond is no more
MOST = 100_000  # maps that are learnt from
WINDOW = 1e-6, 1e6  # of a bandwidth: beyond, squares of distances in its units are no numbers


class MapClassifier(ABC):
    """Learns names from maps: `fit(maps, labels)`, then `predict_proba(map)` or `predict(map)`.

    Attributes:
        classes_: (C,) the sorted labels.
    """

    classes_: NDArray[np.str_]

    __repr__ = readable.line

    def fit(self, maps: Sequence[ArrayLike], labels: Sequence[str]) -> Self:
        """Learn.

        Args:
            maps: (M, X, Y, Z).
            labels: (M,) names.

        Returns:
            The classifier itself.

        Raises:
            ValueError: where the two do not match, for a label that is no text and a map that holds no probabilities.
        """
        names = _texts(labels)
        stack = [_checked(each) for each in _several("maps", maps)]
        if not stack or len(stack) != len(names):
            raise ValueError(f"fit needs as many labels as maps, at least one: got {len(stack)} and {len(names)}")
        shapes = {each.shape for each in stack}
        if len(shapes) > 1:
            raise ValueError(f"maps must all be of one shape, got {', '.join(map(str, sorted(shapes)))}")
        self.classes_, index = np.unique(np.asarray(names, dtype=str), return_inverse=True)
        (self._shape,) = shapes
        self._fit(np.stack(stack), index)
        return self

    def predict_proba(self, map: ArrayLike) -> Array:
        """Tell how probable each label is.

        Args:
            map: (X, Y, Z).

        Returns:
            (C,), of each of `classes_`.

        Raises:
            ValueError: before `fit`, and for a map of another shape or without probabilities.
        """
        if not hasattr(self, "classes_"):
            raise ValueError(f"this {type(self).__name__} is not fitted yet: call fit(maps, labels) first")
        probabilities = _checked(map)
        if probabilities.shape != self._shape:
            raise ValueError(f"map must be of shape {self._shape} as those it was fitted on, got {probabilities.shape}")
        return self._predict_proba(probabilities)

    def predict(self, map: ArrayLike) -> str:
        """Name the most probable label.

        Args:
            map: (X, Y, Z).

        Returns:
            The label.
        """
        best = int(np.argmax(self.predict_proba(map)))
        return str(self.classes_[best])

    @abstractmethod
    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        """Learn from checked `maps` (M, X, Y, Z) of the classes `index` (M,)."""

    @abstractmethod
    def _predict_proba(self, map: Array) -> Array:
        """(C,) for one checked `map`."""


def touch_evidence(map: Array, prior: float) -> Array:
    """Tell what touch added to the log-odds of every voxel. How far the free space around an object was swept says
    nothing of the object.

    Args:
        map: (...) probabilities.
        prior: probability of a voxel of which nothing is known.

    Returns:
        (...) log-odds above the prior's; 0 where there is less than that or nothing is known.
    """
    evidence = np.zeros(map.shape)
    felt = (map > prior) & (map != UNKNOWN)
    evidence[felt] = np.maximum(logit(np.clip(map[felt], *CERTAIN)) - logit(prior), 0.0)
    return evidence


def _checked(map: ArrayLike) -> Array:
    result = validate.probabilities("a map, an occupancy of shape (X, Y, Z),", map, 3)
    if result.size == 0:
        raise ValueError(f"a map must have a voxel at least, got shape {result.shape}")
    return result


def _several(what: str, given: Any) -> list[Any]:
    single = isinstance(given, str | bytes) or (isinstance(given, np.ndarray) and given.ndim == 0)
    if single or not isinstance(given, Iterable) or np.ma.is_masked(given):
        raise ValueError(f"{what} must be a list, got {validate.shown(given)}")
    result = list(islice(given, MOST + 1))
    if len(result) > MOST:
        raise ValueError(f"{what} must be {MOST} at most, got {validate.shown(given)}")
    return result


def _texts(labels: Any) -> list[str]:
    names = _several("labels", labels)
    for name in names:
        if not isinstance(name, str) or "\0" in name:  # which NumPy would cut off
            raise ValueError(f"labels must be text, got {validate.shown(name)}")
    return names
