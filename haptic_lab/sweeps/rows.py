"""The rows of a table of trials (factors, measures, provenance), and its columns in their order."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np

from haptic_env import reading
from haptic_env.shapes.names import NONE
from haptic_lab.conditions import UNTOLD, Condition
from haptic_lab.limits import plain
from haptic_lab.records import BeliefTrace
from haptic_lab.replay import SIMULATED
from haptic_lab.sweeps import log_courses
from haptic_lab.sweeps.measures import COURSES, HISTOGRAMS, MEASURES, OF_MAPS
from haptic_lab.sweeps.meshes import MESHES
from haptic_lab.sweeps.provenance import versions
from haptic_lab.sweeps.results import KEY, TEXTS, listed
from haptic_lab.sweeps.tasks import STREAM, SweepSettings, SweepTask
from observer import variants
from observer.classifiers import CLASSIFIERS, MapClassifier

NOVELTY = ("new", "new_correct")  # whether the object was none of the candidates, and whether that was said rightly
Exemplars = tuple[tuple[tuple[str, bytes], ...], ...]  # for each draw, name and content of the file of each shape


def row_of(
    task: SweepTask, observer: str, trace: BeliefTrace, measured: Mapping[str, Any], exemplars: Exemplars
) -> dict[str, Any]:
    """Make the row of one observer in one trial.

    Args:
        task: the trial.
        observer: its name.
        trace: what it believed.
        measured: of `measures_of`.
        exemplars: maps from which classifiers learn.

    Returns:
        Values by column.
    """
    # What one recording's object may be, that of another may not.
    probabilities = {f"p_{label}": float("nan") for label in task.settings.labels}
    row = {**dict(zip(KEY, (*task.key, observer), strict=True)), **probabilities, **measured}
    named = {STREAM: [trace.name]}
    right = task.settings.right_name(task.shape)
    row |= dict.fromkeys(_map_courses(task.settings), "")
    if plain(observer) in variants.WITHOUT_MAP:
        row |= dict.fromkeys(OF_MAPS, float("nan"))
        named |= {namer: [] for namer in task.settings.classifiers}
    else:
        for namer in task.settings.classifiers:
            fitted = classifiers(namer, observer, task.settings.known, exemplars)
            named[namer] = [each.predict(trace.belief.occupancy) for each in fitted]
            if task.settings.maps_every is not None:
                shares = (np.mean([each.predict(found) == right for each in fitted]) for found in trace.maps)
                row[course_of(namer)] = " ".join(f"{share:.6g}" for share in shares)
    for namer, names in named.items():
        row[namer] = listed(names)
        row[f"{namer}_correct"] = float(np.mean([each == right for each in names])) if names else float("nan")
    if task.settings.none:
        row |= {"new": float(right == NONE), "new_correct": float((trace.name == NONE) == (right == NONE))}
    return row | constants(task.settings)


@lru_cache(maxsize=128)
def classifiers(namer: str, observer: str, labels: Sequence[str], exemplars: Exemplars) -> list[MapClassifier]:
    """Fit a classifier to each draw of exemplars.

    Args:
        namer: a name of `CLASSIFIERS`.
        observer: whose maps it learns from.
        labels: of the maps of a draw, in their order.
        exemplars: the draws.

    Returns:
        A classifier for each draw, fitted once in a process.

    Raises:
        ValueError: for a file that is corrupt.
    """
    fitted = []
    for draw in exemplars:
        maps = []
        for name, content in draw:
            try:
                maps.append(reading.Arrays(content, name)[observer])
            except (ValueError, KeyError) as error:
                raise ValueError(f"the exemplar {name} is corrupt ({error}); delete it and run again") from error
        fitted.append(CLASSIFIERS[namer]().fit(maps, list(labels)))
    return fitted


@lru_cache
def constants(settings: SweepSettings) -> dict[str, str]:
    """Say how every row of a table was made.

    Args:
        settings: what all trials share.

    Returns:
        Values by column.
    """
    # What observers believe is told where it is not what is so.
    given = {name: value for name, value in asdict(settings).items() if value is not None}
    told = {name: listed(value) if isinstance(value, tuple) else str(value) for name, value in given.items()}
    told = {("candidates" if name in ("shapes", "among") else name): value for name, value in told.items()}
    return told | (SIMULATED if settings.recordings else {}) | versions()


def columns(settings: SweepSettings) -> tuple[list[str], list[str]]:
    """List the columns of a table.

    Args:
        settings: what all trials share.

    Returns:
        All, and those that hold numbers.
    """
    correct = [f"{namer}_correct" for namer in settings.namers]
    novelty = NOVELTY if settings.none else ()
    meshes = MESHES if settings.meshes else ()
    numbers = [*MEASURES, *meshes, *(f"p_{label}" for label in settings.labels), *correct, *novelty]
    keys = [name for name in KEY if name not in TEXTS]
    courses = (*COURSES, *_map_courses(settings), *([log_courses.COLUMN] if settings.courses else []))
    return [*KEY, *numbers, *HISTOGRAMS, *courses, *settings.namers, *constants(settings)], [*numbers, *keys]


def course_of(namer: str) -> str:
    """Name the column that says how often a classifier was right through time.

    Args:
        namer: a name of `CLASSIFIERS`.

    Returns:
        Of the column: the share of its draws that named the map right, after each `maps_every`, with spaces between.
    """
    return f"{namer}_course"


def _map_courses(settings: SweepSettings) -> list[str]:
    return [] if settings.maps_every is None else [course_of(namer) for namer in settings.classifiers]


def unusual(conditions: Iterable[Condition]) -> frozenset[str]:
    """List the factors that a table needs though it may do without.

    Args:
        conditions: of its trials.

    Returns:
        Those of `UNTOLD` that are not as usual in one of them.
    """
    return frozenset(name for each in conditions for name in UNTOLD if getattr(each, name) != UNTOLD[name])
