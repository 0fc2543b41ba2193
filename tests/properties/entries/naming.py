"""Classifiers of maps, and the measures of beliefs. M maps, (X, Y, Z) voxels, T steps, J joints, C labels."""

from __future__ import annotations

import inspect
from functools import partial
from typing import Any

import numpy as np
from hypothesis import strategies as st
from sklearn.base import BaseEstimator
from sklearn.naive_bayes import BernoulliNB

from haptic_env.pose import Pose
from observer import classifiers, metrics
from observer.classifiers import CLASSIFIERS, ScikitLearn
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.parameters import Parameter, array, binary, integer, name, number, one_of, several, switch
from tests.properties.rule import Allowed
from tests.properties.strategies import odd_arrays, odd_names, odd_numbers

MAP = (5, 4, 3)
SLOW = {"random_forest": 0.05, "logistic_regression": 0.3, "aligned_nearest_neighbour": 0.3}
ODD_LABELS = st.sampled_from(
    [
        ["a"],
        [],
        None,
        "ab",
        [1, 2, 3, 4],
        [True, False, True, False],
        ["a", float("nan"), "a", "b"],
        ["a", None, "b", "b"],
        ["", "", "", ""],
        [["a"], ["b"], ["a"], ["b"]],
        np.array(["a", "b", "a", "b"]),
        np.array([1, 2, 1, 2]),
        {"a": 1},
        ["ü", "\ud800", "[x]", "a\x00"],
        ["x" * 10_000, "a", "b", "c"],
        3,
        (each for each in "abab"),
    ]
)
KEYWORDS: dict[str, Parameter] = {
    "metric": name(["hamming", "squared", "touched", "overlap"]),
    "neighbours": integer(1, 4),
    "prior": number(0.01, 0.9),
    "bandwidth": number(0.1, 20.0),
    "rotations": name(["none", "yaw"]),
    "reach": number(0.0, 1.0),
    "estimator": one_of(BernoulliNB, lambda: BernoulliNB(alpha=-1.0), BaseEstimator),
}


def _maps() -> list[np.ndarray]:
    return list(np.random.default_rng(0).uniform(0, 1, (4, *MAP)))


def _fitted(made: Any, maps: Any = None, labels: Any = ("a", "b", "a", "b"), map: Any = None) -> Any:
    made.fit(_maps() if maps is None else maps, labels)
    asked = _maps()[0] if map is None else map
    shares, label = made.predict_proba(asked), made.predict(asked)
    assert label in list(made.classes_), (label, made.classes_)
    assert abs(shares.sum() - 1.0) < 1e-6, shares
    assert (shares >= 0.0).all(), shares
    return shares


def _made(build: Any, **keywords: Any) -> Any:
    return _fitted(build(**keywords))


def _keywords_of(build: Any) -> dict[str, Parameter]:
    return {key: KEYWORDS[key] for key in inspect.signature(build).parameters if key in KEYWORDS}


FIT = {
    "maps": several(array(MAP, 0.0, 1.0), 4, 4),
    "labels": Parameter(st.just(["a", "b", "a", "b"]), ODD_LABELS),
    "map": Parameter(array(MAP, 0.0, 1.0).valid, odd_arrays(MAP)),
}
CLASSIFIER = Allowed(words=("map", "label", "fit", "parameter"))

T, C = 6, 3
POSES, POSTERIORS = array((T, samples.JOINTS), -0.2, 1.0), array((T, C), 0.0, 1.0)
OCCUPANCY, CELLS = array(samples.grid().shape, 0.0, 1.0), binary(samples.grid().shape)
PLACES = array((7, 3), -0.06, 0.06)
GRID = Parameter(st.just(samples.grid()), odd_numbers | odd_names)
SOLID = Parameter(st.just(samples.solid()), odd_numbers | odd_names)
HAND = Parameter(st.just(samples.hand()), odd_numbers | odd_names)
VOXELS = number(0.1, 3.0)
ROOTS = Parameter(
    st.none() | st.just([Pose(np.zeros(3), np.eye(3))] * T),
    st.sampled_from([[], [None], [None] * T, [Pose(np.zeros(3), np.eye(3))], 3, "x", [3] * T, {}]),
)
NUMBER = number(0.0, 10.0)
MEASURES: dict[str, dict[str, Parameter]] = {
    "pose_error_deg": {"estimate": POSES.always, "truth": POSES.always},
    "pose_rmse_deg": {"estimate": POSES.always, "truth": POSES.always},
    "credible_coverage": {
        "mean": POSES.always,
        "std": array((T, samples.JOINTS), 0.0, 1.0).always,
        "truth": POSES.always,
        "level": number(0.0, 1.0),
    },
    "rank_counts": {
        "mean": POSES.always,
        "std": array((T, samples.JOINTS), 0.0, 1.0).always,
        "truth": POSES.always,
        "bins": integer(1, 50),
    },
    "touched_places": {
        "hand": HAND.always,
        "joint_angles": POSES.always,
        "contacts": binary((T, samples.PATCHES)).always,
        "solid": SOLID.always,
        "spacing": number(0.002, 0.01),
        "roots": ROOTS,
    },
    "surface_precision": {"occupancy": OCCUPANCY.always, "grid": GRID.always, "solid": SOLID.always, "voxels": VOXELS},
    "surface_recall": {"occupancy": OCCUPANCY.always, "grid": GRID.always, "places": PLACES.always, "voxels": VOXELS},
    "surface_score": {
        "occupancy": OCCUPANCY.always,
        "grid": GRID.always,
        "solid": SOLID.always,
        "touched": PLACES.always,
        "voxels": VOXELS,
    },
    "surface_coverage": {"occupancy": OCCUPANCY.always, "grid": GRID.always, "solid": SOLID.always, "voxels": VOXELS},
    "surface_places": {"solid": SOLID.always, "grid": GRID.always},
    "reachable": {"hand": HAND.always, "joint_angles": POSES.always, "grid": GRID.always, "roots": ROOTS},
    "swept": {"hand": HAND.always, "joint_angles": POSES.always, "grid": GRID.always, "roots": ROOTS},
    "neighbourhood": {"cells": CELLS.always, "faces": switch()},
    "reached_into": {"solid": SOLID.always, "grid": GRID.always},
    "reliability": {
        "occupancy": OCCUPANCY.always,
        "truth": CELLS.always,
        "cells": CELLS.always,
        "bins": integer(1, 20),
    },
    "accuracy": {"correct": binary((9,)).always, "level": number(0.01, 0.99)},
    "time_to_decision": {
        "seconds": array((T,), 0.0, 5.0).always,
        "posterior": POSTERIORS.always,
        "threshold": number(0.0, 1.0),
    },
    "closure": {"slam": NUMBER.always, "floor": NUMBER.always, "ceiling": NUMBER.always},
}

ENTRIES: dict[str, Entry] = {
    **{
        f"observer.classifiers.CLASSIFIERS[{kind}]": Entry(
            lambda build=build, **call: _fitted(build(), **call), FIT, CLASSIFIER, weight=2 * SLOW.get(kind, 1.0)
        )
        for kind, build in CLASSIFIERS.items()
    },
    **{
        f"observer.classifiers.make[{kind}]": Entry(
            partial(_made, partial(classifiers.make, kind)),
            {**_keywords_of(build), "no_such_keyword": one_of(1)},
            CLASSIFIER,
            weight=0.5 * SLOW.get(kind, 1.0),
        )
        for kind, build in CLASSIFIERS.items()
    },
    "observer.classifiers.make": Entry(
        lambda name: _fitted(classifiers.make(name)),
        {"name": name(set(CLASSIFIERS) - {"random_forest"}).always},
        CLASSIFIER,
    ),
    "observer.classifiers.ScikitLearn": Entry(
        lambda estimator: _fitted(ScikitLearn(estimator)), {"estimator": KEYWORDS["estimator"].always}, CLASSIFIER
    ),
    **{
        f"observer.metrics.{measure}": Entry(
            getattr(metrics, measure), keywords, Allowed(nan=True, nan_of_nan=measure == "closure", words=("object",))
        )
        for measure, keywords in MEASURES.items()
    },
}
