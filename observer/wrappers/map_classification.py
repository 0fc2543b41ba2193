"""A classifier of maps beside an observer: what it must be, and what it says of a map.

Shapes: C labels, (X, Y, Z) voxels.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.arrays import Array

EVERY = 10  # control steps: five times a second at the usual rate
SUMS_TO = 1e-3  # how far from 1 probabilities may add up: some estimators compute in single precision
LIKE = "a fitted one of observer.classifiers, with classes_ and predict_proba(map) (ScikitLearn takes estimators)"


def check_classifier(classifier: Any, observer: Any) -> None:
    """Try a classifier on the empty map of an observer, before any work is done.

    Args:
        classifier: of maps.
        observer: has the maps.

    Raises:
        ValueError: for an observer without a map, what is no classifier, one that is not fitted, and one of other maps.
    """
    if not callable(getattr(observer, "map_now", None)):
        raise ValueError(
            "a classifier of maps needs an observer that has one (map_now), such as a HapticSLAM, got "
            f"{validate.shown(observer)}"
        )
    if isinstance(classifier, type) or not callable(getattr(classifier, "predict_proba", None)):
        raise ValueError(f"classifier must be {LIKE}, or None, got {validate.shown(classifier)}")
    kind = type(classifier).__name__
    if not hasattr(classifier, "classes_"):
        raise ValueError(f"this {kind} is not fitted yet: call fit(maps, labels) before it is given as classifier")
    labels_of(classifier)
    try:
        classify(classifier, np.full(observer.grid.shape, 0.5))
    except Exception as error:
        told = " ".join(str(error).split())
        raise ValueError(f"classifier must be {LIKE}; this {kind} fails on an empty map: {told}") from error


def labels_of(classifier: Any) -> tuple[str, ...]:
    """Tell the names that a classifier gives.

    Args:
        classifier: that is fitted.

    Returns:
        (C,) names.

    Raises:
        ValueError: where its `classes_` are no names, or not all different.
    """
    labels = classifier.classes_
    if isinstance(labels, str) or not isinstance(labels, Iterable):
        raise ValueError(f"classes_ of the classifier must be names, got {validate.shown(labels)}")
    names = validate.names("classes_ of the classifier", [str(each) for each in labels])
    if not names or len(set(names)) != len(names):
        raise ValueError(f"classes_ of the classifier must be names, all different, got {validate.shown(list(names))}")
    return names


def classify(classifier: Any, map: ArrayLike) -> NDArray[np.float64]:
    """Ask a classifier about a map.

    Args:
        classifier: that is fitted.
        map: (X, Y, Z) probabilities.

    Returns:
        (C,) probability of each of its `classes_`.

    Raises:
        ValueError: where it says something else.
    """
    labels = len(labels_of(classifier))
    said: Array = validate.array("what predict_proba says", classifier.predict_proba(map), (labels,), bound=1.0)
    if (said < 0.0).any() or abs(said.sum() - 1.0) > SUMS_TO:
        raise ValueError(f"what predict_proba says must be probabilities that add up to 1, got {said.tolist()}")
    return said.copy()
