"""The registry of classifiers of maps: add one as a file here and a line in `CLASSIFIERS`, or one of scikit-learn's
as a line alone."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.naive_bayes import BernoulliNB

from haptic_env import validate
from observer.classifiers.aligned import AlignedNearestNeighbour
from observer.classifiers.base import MapClassifier
from observer.classifiers.nearest_neighbour import NearestNeighbour
from observer.classifiers.scikit_learn import ScikitLearn
from observer.classifiers.shape_likelihood import ShapeLikelihood

CLASSIFIERS: dict[str, Callable[..., MapClassifier]] = {
    "nearest_neighbour": NearestNeighbour,
    "touched_nearest_neighbour": partial(NearestNeighbour, "touched"),
    "overlap_nearest_neighbour": partial(NearestNeighbour, "overlap"),
    "squared_nearest_neighbour": partial(NearestNeighbour, "squared"),  # what was felt to be empty counts as well
    "shape_likelihood": ShapeLikelihood,
    "aligned_nearest_neighbour": AlignedNearestNeighbour,
    "logistic_regression": partial(ScikitLearn, LogisticRegression()),
    "random_forest": partial(ScikitLearn, RandomForestClassifier(300, random_state=0)),
    "naive_bayes": partial(ScikitLearn, BernoulliNB()),  # occupied or not: p > 0.5
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
