"""Any of scikit-learn's classifiers on maps: "different categorisation models can be incorporated and compared"
(paper, section 4).

Shapes: M maps, V = X·Y·Z voxels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from observer.classifiers.base import MapClassifier


class ScikitLearn(MapClassifier):
    """A classifier of scikit-learn on p - 0.5 of each voxel: what is unknown is 0.

    Some (linear discriminants, calibrated support vectors) need several maps a label and say so in `fit`.
    """

    def __init__(self, estimator: Any) -> None:
        """Take the estimator.

        Args:
            estimator: any of scikit-learn's with `predict_proba`.

        Raises:
            ValueError: for what is none.
        """
        fits = hasattr(estimator, "fit") and hasattr(estimator, "predict_proba")
        if not fits or isinstance(estimator, type):
            raise ValueError(
                f"estimator must be an instance with scikit-learn's fit and predict_proba, got {estimator!r}"
            )
        self.estimator = estimator

    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        self._model = None
        if len(self.classes_) == 1:
            return  # most estimators refuse; there is nothing to learn
        from sklearn.base import clone  # see `observer.classifiers`

        # In one order whatever the caller's: an estimator that draws at random would else depend on it.
        order = sorted(range(len(maps)), key=lambda m: (index[m], maps[m].tobytes()))
        self._model = clone(self.estimator).fit(_features(maps[order]), index[order])

    def _predict_proba(self, map: Array) -> Array:
        if self._model is None:
            return np.ones(1)
        return np.asarray(self._model.predict_proba(_features(map[None]))[0], dtype=np.float64)


def _features(maps: Array) -> Array:
    """(M, V)."""
    return maps.reshape(len(maps), -1) - 0.5
