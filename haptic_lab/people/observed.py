"""What observers would have answered in people's trials, from the results of `haptic-slam evaluate`.

C names, R repeats of a cell (the same object with other noise and another movement).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import expit

from haptic_env import reading, validate
from haptic_env.arrays import Array
from haptic_lab.conditions import factors_in
from haptic_lab.people.courses import Courses
from haptic_lab.people.intervals import difference
from haptic_lab.people.scoring import NO, YES
from haptic_lab.people.sweep_courses import condition_of
from haptic_lab.style import OBSERVER_NAMES
from haptic_lab.sweeps import log_courses
from observer import metrics

LEAST = 1e-300  # of a probability
NEAR = 1.05  # times as long an observer may have explored, or people
TABLE = "trials.csv"
DECIDED = "time_to_decision"
APART = ("condition", "recording", "seconds")  # factors by which trials are found, and observers not told apart


class Cell(NamedTuple):
    """What people explored in one or more trials.

    Attributes:
        object: name of a shape.
        condition: "" where there is none.
        recording: path; "" where there is none.
        seconds: s.
    """

    object: str
    condition: str
    recording: str
    seconds: float


class Found(NamedTuple):
    """An observer in one cell.

    Attributes:
        posterior: (R, C) of each name.
        decided: (R,) s, from when on it is sure; infinite where it never is.
        explorations: (R,) which these are: at another time of the cell the same number is the same exploration.
    """

    posterior: Array
    decided: Array
    explorations: NDArray[Any]


class Observed(NamedTuple):
    """An observer.

    Attributes:
        label: what it is called.
        names: (C,) that it chooses from.
        find: what it believed in a cell; None where it did not explore it.
    """

    label: str
    names: tuple[str, ...]
    find: Callable[[Cell], Found | None]


def read_observers(path: Path | str) -> list[Observed]:
    """Read what observers believed.

    Args:
        path: a folder of `haptic-slam evaluate`, or an `.npz` of `Courses`.

    Returns:
        An observer for each of those of the sweep, its noises, policies and what else varies but time.

    Raises:
        ValueError: for a folder that is none, or a table without posteriors.
        OSError: where it cannot be read.
    """
    place = validate.path("observers", path)
    if not place.is_dir():
        return of_courses(Courses.load(place), place.stem)
    return of_table(_table(place / TABLE))


def of_courses(courses: Courses, label: str) -> list[Observed]:
    """Take observers from courses.

    Args:
        courses: of one observer.
        label: what it is called.

    Returns:
        An observer for each noise.
    """
    several = len(courses.sigmas) > 1
    return [
        Observed(f"{label}, σ = {sigma:g}°" if several else label, courses.names, _in_courses(courses, index))
        for index, sigma in enumerate(courses.sigmas)
    ]


def of_table(rows: pd.DataFrame) -> list[Observed]:
    """Take observers from the table of a sweep.

    Args:
        rows: of its trials.csv.

    Returns:
        An observer for each of those of the sweep, its noises, policies and what else varies but time.
    """
    columns = [name for name in rows if str(name).startswith("p_")]
    names = tuple(str(name).removeprefix("p_") for name in columns)
    factors = [name for name in factors_in(rows.columns) if name not in APART]
    varying = ["observer", *(name for name in factors if rows[name].nunique(dropna=False) > 1)]
    found = []
    for values, mine in rows.groupby(varying, sort=False, dropna=False):
        told = dict(zip(varying, values, strict=True))
        observer = str(told.pop("observer"))
        label = ", ".join([OBSERVER_NAMES.get(observer, observer), *(_said(*each) for each in told.items())])
        found.append(Observed(validate.plain(label), names, _in_table(mine, columns)))
    return found


def in_two_intervals(observer: Observed, standard: str) -> Observed:
    """Let an observer choose between two intervals, the comparison and the standard, each an exploration of its own.

    Args:
        observer: that names objects.
        standard: what one of the intervals has; of a cell the object is the comparison.

    Returns:
        The observer that answers "yes" where it names the right interval; it does not tell when it is sure.
    """

    def find(cell: Cell) -> Found | None:
        if not {cell.object, standard} <= {*observer.names}:
            return None
        felt = [observer.find(each) for each in (cell, cell._replace(object=standard, recording=""))]
        ours, theirs = (None if each is None else _against(each.posterior, cell.object) for each in felt)
        if ours is None or theirs is None or min(len(ours), len(theirs)) < 2:
            return None
        count = min(len(ours), len(theirs))
        told = difference(ours[:count, None], theirs[:count, None])[:, 0]
        return Found(np.stack([expit(told), expit(-told)], axis=1), np.full(count, math.inf), np.arange(count))

    def _against(posterior: Array, name: str) -> Array:
        ours, theirs = (np.maximum(posterior[:, observer.names.index(each)], LEAST) for each in (name, standard))
        return np.asarray(np.log(ours / theirs))

    return Observed(observer.label, (YES, NO), find)


def _table(path: Path) -> pd.DataFrame:
    if not path.is_file():
        raise ValueError(
            f"observers must be a folder of haptic-slam evaluate, with {TABLE} in it, or a .npz of courses, got "
            f"{validate.shown(str(path.parent))}"
        )
    try:
        reading.content(path)  # bounds its size
        rows = pd.read_csv(path)
    except (ValueError, UnicodeDecodeError) as error:  # of which pandas' errors are some
        raise ValueError(f"{path}: not the table of a sweep ({' '.join(str(error).split())})") from error
    needed = ("observer", "shape", "seconds", DECIDED)
    missing = [name for name in needed if name not in rows]
    posteriors = [name for name in rows if str(name).startswith("p_")]
    if missing or not posteriors:
        told = validate.listed(missing or ["p_NAME"])
        raise ValueError(f"{path}: not the table of a sweep that people can be held against: there is no {told} in it")
    if rows.empty:
        raise ValueError(f"{path}: there are no trials in it yet")
    wrong = [name for name in (*posteriors, "seconds", DECIDED) if not pd.api.types.is_numeric_dtype(rows[name])]
    if wrong:
        raise ValueError(f"{path}: not all are numbers in {validate.listed(wrong)}")
    outside = [name for name in posteriors if ((rows[name] < 0.0) | (rows[name] > 1.0)).any()]
    if outside:
        raise ValueError(f"{path}: not all are probabilities in {validate.listed(outside)}")
    if not (rows["seconds"] > 0.0).all():
        raise ValueError(f"{path}: not all seconds are above 0")
    return rows


def _in_table(rows: pd.DataFrame, columns: Sequence[str]) -> Callable[[Cell], Found | None]:
    told = {
        name: name in rows and rows[name].fillna("").astype(str).ne("").any() for name in ("condition", "recording")
    }
    keys = ["shape", *(name for name in told if told[name])]
    plain = rows.assign(**{name: rows[name].fillna("").astype(str) for name in keys})
    groups = dict(iter(plain.groupby(keys, sort=False)))

    courses = log_courses.COLUMN in rows

    def find(cell: Cell) -> Found | None:
        mine = groups.get((cell.object, *(getattr(cell, name) for name in keys[1:])))
        if mine is None:
            return None
        times = mine["seconds"].to_numpy(dtype=np.float64)
        long = times[times * NEAR >= cell.seconds]
        if not len(long) or not (courses or _near(long.min(), cell.seconds)):
            return None
        there = mine[times == long.min()]
        decided = there[DECIDED].fillna(math.inf).to_numpy(dtype=np.float64)
        if courses:
            posterior = np.array([_at(text, cell.seconds, len(columns)) for text in there[log_courses.COLUMN]])
        else:  # empty is what this recording's object cannot be
            posterior = there[list(columns)].fillna(0.0).to_numpy(dtype=np.float64)
        whole = posterior.sum(axis=1) > 0.0
        numbers = there["seed"].to_numpy() if "seed" in there else np.arange(len(there))
        return Found(posterior[whole], decided[whole], numbers[whole]) if whole.any() else None

    return find


def _at(text: object, seconds: float, names: int) -> Array:
    """(C,) of a course that is written in a table, where it is that long, or else at its end."""
    try:
        course = np.array(str(text).split(), dtype=np.float64).reshape(-1, names)
    except ValueError:
        raise ValueError(
            f"{log_courses.COLUMN} must be numbers for {names} names, got {validate.shown(text)}"
        ) from None
    if not len(course):
        return np.zeros(names)
    index = min(int((seconds + 1e-9) / log_courses.SECONDS), len(course) - 1)
    return np.asarray(np.nan_to_num(np.exp(course[index])))


def _in_courses(courses: Courses, sigma: int) -> Callable[[Cell], Found | None]:
    several = any(courses.conditions)

    def find(cell: Cell) -> Found | None:
        condition = condition_of(cell.condition, cell.recording) if several else ""
        if (cell.object, condition) not in courses.cells:
            return None
        course = courses.log_posterior[courses.cell(cell.object, condition), sigma]  # (R, T, C)
        until = int(np.searchsorted(courses.seconds, cell.seconds * (1.0 + 1e-9), side="right")) - 1
        if until < 0 or not _near(max(courses.seconds[until], 1e-9), cell.seconds):
            return None
        there = ~np.isnan(course[:, until]).any(axis=1)
        if not there.any():
            return None
        course = np.exp(course[there])
        return Found(course[:, until], _decisions(course, courses.seconds), np.flatnonzero(there))

    return find


def _decisions(course: Array, seconds: Array) -> Array:
    """(R,) s, from when on each of the (R, T, C) probabilities is sure; infinite where one never is."""
    found = []
    for each in course:
        known = ~np.isnan(each).any(axis=1)
        found.append(metrics.time_to_decision(seconds[known], each[known]))
    return np.nan_to_num(np.array(found), nan=math.inf, posinf=math.inf)


def _near(one: float, other: float) -> bool:
    return max(one, other) <= NEAR * min(one, other)


def _said(name: str, value: object) -> str:
    return f"σ = {value:g}°" if name == "sigma_deg" else f"{name.replace('_', ' ')} {value}"
