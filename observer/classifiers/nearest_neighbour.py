"""Nearest neighbour among explored maps: the paper's one-shot classifier (section 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from sklearn.neighbors import KNeighborsClassifier

from haptic_env import validate
from observer.classifiers.base import Array, MapClassifier, touch_evidence
from observer.contact_model import ContactModel

METRICS = {"hamming": "hamming", "squared": "sqeuclidean", "touched": "hamming", "overlap": "jaccard"}
DOUBLED = np.log(2.0)


class NearestNeighbour(MapClassifier):
    """With one map a class, one-shot learning.

    `metric` "hamming" compares which voxels are occupied (p > 0.5), as the paper does; "touched" which of them touch
    has made at least twice as likely as their `prior` (in odds), which the paper's are where the prior is 0.5;
    "overlap" looks at the same voxels, but at the share that two maps have in common of all that either has (Jaccard
    1912, New Phytologist 11(2), 37-50), so that a map of few touches is not near to every other such map; "squared"
    compares the probabilities. `prior`: of the maps, `ContactModel.prior`.
    """

    def __init__(self, metric: str = "hamming", neighbours: int = 1, prior: float = ContactModel.prior) -> None:
        self.metric = validate.choice("metric", metric, METRICS)
        self.neighbours = validate.integer("neighbours", neighbours, 1)
        self.prior = validate.number("prior", prior, 0.0, 0.999, above=0.0)

    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        self._model = KNeighborsClassifier(self.neighbours, metric=METRICS[self.metric], algorithm="brute")
        self._model.fit(self._features(maps), index)

    def _predict_proba(self, map: Array) -> Array:
        return self._model.predict_proba(self._features(map[None]))[0]

    def _features(self, maps: Array) -> Array | NDArray[np.bool_]:
        flat = maps.reshape(len(maps), -1)
        if self.metric in ("touched", "overlap"):
            doubled = touch_evidence(flat, self.prior) >= DOUBLED
            return doubled if self.metric == "overlap" else doubled.astype(np.float64)
        return (flat > 0.5).astype(np.float64) if self.metric == "hamming" else flat
