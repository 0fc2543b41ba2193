"""The registry of classifiers of maps: add one as a file here and a line in `CLASSIFIERS`, or one of scikit-learn's
as a line alone."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

from haptic_env import validate
from observer.classifiers.aligned import AlignedNearestNeighbour
from observer.classifiers.base import MapClassifier
from observer.classifiers.nearest_neighbour import NearestNeighbour
from observer.classifiers.scikit_learn import ScikitLearn
from observer.classifiers.shape_likelihood import ShapeLikelihood


def _of_scikit_learn(module: str, name: str, keywords: dict[str, Any]) -> MapClassifier:
    """One of its estimators, imported when it is made: that takes a second, and few sweeps ask for it."""
    return ScikitLearn(getattr(importlib.import_module(f"sklearn.{module}"), name)(**keywords))


CLASSIFIERS: dict[str, Callable[..., MapClassifier]] = {
    "nearest_neighbour": NearestNeighbour,
    "touched_nearest_neighbour": partial(NearestNeighbour, "touched"),
    "overlap_nearest_neighbour": partial(NearestNeighbour, "overlap"),
    "squared_nearest_neighbour": partial(NearestNeighbour, "squared"),  # what was felt to be empty counts as well
    "shape_likelihood": ShapeLikelihood,
    "aligned_nearest_neighbour": AlignedNearestNeighbour,
    "logistic_regression": partial(_of_scikit_learn, "linear_model", "LogisticRegression", {}),
    "random_forest": partial(
        _of_scikit_learn, "ensemble", "RandomForestClassifier", {"n_estimators": 300, "random_state": 0}
    ),
    "naive_bayes": partial(_of_scikit_learn, "naive_bayes", "BernoulliNB", {}),  # occupied or not: p > 0.5
}

__all__ = [
    "CLASSIFIERS",
    "AlignedNearestNeighbour",
    "MapClassifier",
    "NearestNeighbour",
    "ScikitLearn",
    "ShapeLikelihood",
    "make",
]


def make(name: str, **keywords: Any) -> MapClassifier:
    """Make a classifier.

    Args:
        name: one of `CLASSIFIERS`.
        **keywords: of its constructor.

    Returns:
        The classifier.

    Raises:
        ValueError: for an unknown name or keyword, and for a value out of range.
    """
    build = CLASSIFIERS[validate.choice("classifier", name, CLASSIFIERS)]
    validate.keywords(f"{name} classifier", keywords, inspect.signature(build).parameters)
    return build(**keywords)
