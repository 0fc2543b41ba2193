"""Nearest neighbour among explored maps: the paper's one-shot classifier (section 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from haptic_env import validate
from haptic_env.arrays import Array
from observer.classifiers.base import MapClassifier, touch_evidence
from observer.maps.contact_model import ContactModel

METRICS = {"hamming": "hamming", "squared": "sqeuclidean", "touched": "hamming", "overlap": "jaccard"}
DOUBLED = np.log(2.0)


class NearestNeighbour(MapClassifier):
    """With one map a class, one-shot learning.

    Of the metrics "hamming" compares which voxels are occupied (p > 0.5), as the paper does; "touched" which of them
    touch has made at least twice as likely as their prior (in odds), which the paper's are where the prior is 0.5;
    "overlap" looks at the same voxels, but at the share that two maps have in common of all that either has (Jaccard
    1912, New Phytologist 11(2), 37-50), so that a map of few touches is not near to every other such map; "squared"
    compares the probabilities. Of maps that are equally near the one that was learnt first counts.
    """

    def __init__(self, metric: str = "hamming", neighbours: int = 1, prior: float = ContactModel.prior) -> None:
        """Check the arguments.

        Args:
            metric: one of `METRICS`.
            neighbours: how many have a say.
            prior: of the maps, `ContactModel.prior`.

        Raises:
            ValueError: for a value out of range.
        """
        self.metric = validate.choice("metric", metric, METRICS)
        self.neighbours = validate.integer("neighbours", neighbours, 1)
        self.prior = validate.number("prior", prior, 0.0, 0.999, above=0.0)

    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        self._known, self._index = self._features(maps), index

    def _predict_proba(self, map: Array) -> Array:
        distance = cdist(self._features(map[None]), self._known, METRICS[self.metric])[0]
        nearest = np.argsort(distance, kind="stable")[: self.neighbours]
        return np.bincount(self._index[nearest], minlength=len(self.classes_)) / len(nearest)

    def _features(self, maps: Array) -> Array | NDArray[np.bool_]:
        flat = maps.reshape(len(maps), -1)
        if self.metric == "squared":
            return flat
        if self.metric == "hamming":
            return (flat > 0.5).astype(np.float64)
        doubled = touch_evidence(flat, self.prior) >= DOUBLED
        return doubled if self.metric == "overlap" else doubled.astype(np.float64)
