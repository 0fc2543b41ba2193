"""The registry of classifiers of maps: add one as a file here and a line in `CLASSIFIERS`."""

from __future__ import annotations

import inspect
from typing import Any

from haptic_env import validate
from observer.classifiers.base import MapClassifier
from observer.classifiers.nearest_neighbour import NearestNeighbour
from observer.classifiers.shape_likelihood import ShapeLikelihood

CLASSIFIERS: dict[str, type[MapClassifier]] = {
    "nearest_neighbour": NearestNeighbour,
    "shape_likelihood": ShapeLikelihood,
}

__all__ = ["CLASSIFIERS", "MapClassifier", "NearestNeighbour", "ShapeLikelihood", "make"]


def make(name: str, **keywords: Any) -> MapClassifier:
    """Make the classifier `name`; raises `ValueError` for an unknown name or keyword."""
    build = CLASSIFIERS[validate.choice("classifier", name, CLASSIFIERS)]
    validate.keywords(f"{name} classifier", keywords, inspect.signature(build).parameters)
    return build(**keywords)
