"""Bayesian shape likelihood of a map: how probable is what was felt if the object were this one?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.special import logsumexp, softmax

from haptic_env import validate
from observer.classifiers.base import Array, MapClassifier


class ShapeLikelihood(MapClassifier):
    """Fitted on the true occupancies of the candidates (`Solid.occupancy`), or on explored maps.

    A map's entry is the evidence that its voxel is occupied, p / (1 - p) to one. Under a hypothesis that fills the
    voxel with probability o the evidence has likelihood o·p + (1 - o)·(1 - p) up to a factor that all hypotheses
    share; voxels multiply. Several maps of one label are its variants (sizes, poses): it has their mean likelihood.
    `blur`, in voxels, is the uncertainty of the pose; `temper` discounts that neighbouring voxels are not
    independent.
    """

    def __init__(self, blur: float = 0.6, temper: float = 0.1) -> None:
        self.blur = validate.number("blur", blur, 0.0, 10.0, unit="voxels")
        self.temper = validate.number("temper", temper, 0.0, 1.0)

    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        soft = np.stack([gaussian_filter(each, self.blur) if self.blur else each for each in maps])
        self._templates = np.clip(soft, 0.005, 0.995).reshape(len(maps), -1)
        self._index = index

    def _predict_proba(self, map: Array) -> Array:
        p = np.clip(map.ravel(), 1e-6, 1 - 1e-6)
        informed = p != 0.5
        o = self._templates[:, informed]
        log_likelihood = self.temper * np.log(o * p[informed] + (1 - o) * (1 - p[informed])).sum(axis=1)
        per_class = [
            logsumexp(log_likelihood[self._index == c]) - np.log((self._index == c).sum())
            for c in range(len(self.classes_))
        ]
        return softmax(np.array(per_class))
