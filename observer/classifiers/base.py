"""What a classifier of maps is: scikit-learn's own names, one map at a time.

Shapes: M maps, C classes, (X, Y, Z) voxels. A map is an occupancy: the probability of each voxel, 0.5 where unknown.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logit

Array = NDArray[np.float64]
UNKNOWN = 0.5  # what a map says of a voxel that the hand never came near
CERTAIN = 0.001, 0.999  # evidence beyond is no more


class MapClassifier(ABC):
    """`fit(maps, labels)`, then `predict_proba(map)` or `predict(map)`; `classes_` (C,) are the sorted labels."""

    classes_: NDArray[np.str_]

    def fit(self, maps: Sequence[ArrayLike], labels: Sequence[str]) -> Self:
        """Learn from `maps` (M, X, Y, Z) and their `labels` (M,). Raises `ValueError` where they do not match."""
        stack = np.stack([_checked(each) for each in maps]) if len(maps) else np.empty((0, 0, 0, 0))
        if len(stack) == 0 or len(stack) != len(labels):
            raise ValueError(f"fit needs as many labels as maps, at least one: got {len(maps)} and {len(labels)}")
        self.classes_, index = np.unique(np.asarray(labels, dtype=str), return_inverse=True)
        self._shape = stack.shape[1:]
        self._fit(stack, index)
        return self

    def predict_proba(self, map: ArrayLike) -> Array:
        """Probability (C,) of each of `classes_` for one `map` (X, Y, Z). Raises `ValueError` before `fit`."""
        if not hasattr(self, "classes_"):
            raise ValueError(f"this {type(self).__name__} is not fitted yet: call fit(maps, labels) first")
        probabilities = _checked(map)
        if probabilities.shape != self._shape:
            raise ValueError(f"map must be of shape {self._shape} as those it was fitted on, got {probabilities.shape}")
        return self._predict_proba(probabilities)

    def predict(self, map: ArrayLike) -> str:
        """The most probable label for one `map` (X, Y, Z)."""
        best = int(np.argmax(self.predict_proba(map)))
        return str(self.classes_[best])

    @abstractmethod
    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        """Learn from checked `maps` (M, X, Y, Z) of the classes `index` (M,)."""

    @abstractmethod
    def _predict_proba(self, map: Array) -> Array:
        """(C,) for one checked `map`."""


def touch_evidence(map: Array, prior: float) -> Array:
    """What touch added to the log-odds of every voxel: those of `map` (...) above the `prior`'s, 0 where there is less
    than that or nothing is known. How far the free space around an object was swept says nothing of the object.
    """
    evidence = np.zeros(map.shape)
    felt = (map > prior) & (map != UNKNOWN)
    evidence[felt] = np.maximum(logit(np.clip(map[felt], *CERTAIN)) - logit(prior), 0.0)
    return evidence


def _checked(map: ArrayLike) -> Array:
    result = np.asarray(map, dtype=np.float64)
    if result.ndim != 3:
        raise ValueError(f"a map is an occupancy of shape (X, Y, Z), got shape {result.shape}")
    if not ((result >= 0) & (result <= 1)).all():
        raise ValueError("a map holds probabilities in [0, 1]; got values outside it or NaN")
    return result
