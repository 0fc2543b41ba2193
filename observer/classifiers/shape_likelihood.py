"""Bayesian shape likelihood of a map, learnt from explored maps: a Parzen window (Parzen 1962, Ann. Math. Stat. 33).

For the likelihood of a known shape given the whole stream of beliefs, without exemplars, see
`observer.shape.posterior`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from scipy.special import logsumexp, softmax

from haptic_env import validate
from haptic_env.arrays import Array
from observer.classifiers.base import WINDOW, MapClassifier, touch_evidence
from observer.maps.contact_model import ContactModel


class ShapeLikelihood(MapClassifier):
    """p(map | label) is the mean over the label's maps of a normal density about each, voxels independent, of what
    touch added to each voxel's log-odds.

    With one map a label it learns in one shot, and several maps of a label are its variants (sizes, poses, other
    explorations).
    """

    def __init__(self, bandwidth: float = 8.0, prior: float = ContactModel.prior) -> None:
        """Check the arguments.

        Args:
            bandwidth: SD of the window, in log-odds; it sets how sure the posterior is.
            prior: of the maps, `ContactModel.prior`.

        Raises:
            ValueError: for a value out of range.
        """
        self.bandwidth = validate.number("bandwidth", bandwidth, *WINDOW, unit="log-odds")
        self.prior = validate.number("prior", prior, 0.0, 0.999, above=0.0)

    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        self._exemplars = touch_evidence(maps, self.prior).reshape(len(maps), -1)
        self._index = index

    def _predict_proba(self, map: Array) -> Array:
        square = cdist(touch_evidence(map, self.prior).reshape(1, -1), self._exemplars, "sqeuclidean")[0]
        log_likelihood = -0.5 * square / self.bandwidth**2
        per_class = [
            logsumexp(log_likelihood[self._index == c]) - np.log((self._index == c).sum())
            for c in range(len(self.classes_))
        ]
        return softmax(np.array(per_class))
