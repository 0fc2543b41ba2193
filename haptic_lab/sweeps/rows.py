"""The rows of a table, and its columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np

from haptic_env import reading
from haptic_lab.sweeps.measures import COURSES, HISTOGRAMS, MEASURES, OF_MAPS
from haptic_lab.sweeps.provenance import versions
from haptic_lab.sweeps.results import KEY, listed
from haptic_lab.sweeps.tasks import STREAM, SweepSettings, SweepTask
from haptic_lab.trial import BeliefTrace
from observer import variants
from observer.classifiers import CLASSIFIERS, MapClassifier

Exemplars = tuple[tuple[tuple[str, bytes], ...], ...]  # for each draw, name and content of the file of each shape


def row_of(
    task: SweepTask, observer: str, trace: BeliefTrace, measured: Mapping[str, Any], exemplars: Exemplars
) -> dict[str, Any]:
    """The row of one `observer` in one trial."""
    row = {**dict(zip(KEY, (*task.key, observer), strict=True)), **measured}
    named = {STREAM: [trace.name]}
    if observer in variants.WITHOUT_MAP:
        row |= dict.fromkeys(OF_MAPS, float("nan"))
        named |= {namer: [] for namer in task.settings.classifiers}
    else:
        for namer in task.settings.classifiers:
            fitted = classifiers(namer, observer, task.settings.shapes, exemplars)
            named[namer] = [each.predict(trace.belief.occupancy) for each in fitted]
    for namer, names in named.items():
        row[namer] = listed(names)
        row[f"{namer}_correct"] = float(np.mean([each == task.shape for each in names])) if names else float("nan")
    return row | constants(task.settings)


@lru_cache(maxsize=128)
def classifiers(namer: str, observer: str, labels: Sequence[str], exemplars: Exemplars) -> list[MapClassifier]:
    """The classifier `namer`, fitted once on each draw of the observer's `exemplars`, one for each of `labels`."""
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
    """What every row says of how it was made."""
    told = {name: listed(value) if isinstance(value, tuple) else str(value) for name, value in asdict(settings).items()}
    told = {("candidates" if name == "shapes" else name): value for name, value in told.items()}
    return told | versions()


def columns(settings: SweepSettings) -> tuple[list[str], list[str]]:
    """The columns of the table, and those that hold numbers."""
    correct = [f"{namer}_correct" for namer in settings.namers]
    numbers = [*MEASURES, *(f"p_{shape}" for shape in settings.shapes), *correct]
    keys = [name for name in KEY if name not in ("policy", "shape", "observer")]
    return [*KEY, *numbers, *HISTOGRAMS, *COURSES, *settings.namers, *constants(settings)], [*numbers, *keys]
