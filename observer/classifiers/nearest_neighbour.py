"""Nearest neighbour among explored maps: the paper's one-shot classifier (section 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from sklearn.neighbors import KNeighborsClassifier

from haptic_env import validate
from observer.classifiers.base import Array, MapClassifier

METRICS = {"hamming": "hamming", "squared": "sqeuclidean"}


class NearestNeighbour(MapClassifier):
    """With one map a class, one-shot learning. `metric` "hamming" compares which voxels are occupied (p > 0.5), as
    the paper does; "squared" the probabilities, so that what was felt to be empty counts as well."""

    def __init__(self, metric: str = "hamming", neighbours: int = 1) -> None:
        self.metric = validate.choice("metric", metric, METRICS)
        self.neighbours = validate.integer("neighbours", neighbours, 1)

    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        self._model = KNeighborsClassifier(self.neighbours, metric=METRICS[self.metric], algorithm="brute")
        self._model.fit(self._features(maps), index)

    def _predict_proba(self, map: Array) -> Array:
        return self._model.predict_proba(self._features(map[None]))[0]

    def _features(self, maps: Array) -> Array:
        flat = maps.reshape(len(maps), -1)
        return (flat > 0.5).astype(np.float64) if self.metric == "hamming" else flat
