"""Courses of a sweep: what `haptic-slam evaluate --courses` kept, put in order.

Shapes: K times, C names.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.special import log_softmax

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_lab.conditions import FACTORS, UNTOLD
from haptic_lab.sweeps import log_courses
from haptic_lab.sweeps.results import CHECK, checksum

APART = ("sigma_deg", "seconds", "recording", "condition")  # of `FACTORS`: told otherwise
CLOSE = 1e-3  # nats, by which what is written down may miss a probability of 1


class Course(NamedTuple):
    """One trial of one observer.

    Attributes:
        object: that was explored.
        told: of `FACTORS`, as texts.
        sigma: degrees.
        seed: of the trial.
        names: (C,).
        log_posterior: (K, C) nats.
    """

    object: str
    told: Mapping[str, str]
    sigma: float
    seed: int
    names: tuple[str, ...]
    log_posterior: Array


def condition_of(condition: str = "", recording: str = "") -> str:
    """Say how the condition of a cell is called.

    Args:
        condition: of the trial.
        recording: path of the one that it is of, if any: a cell of its own.

    Returns:
        The name.
    """
    return " ".join(each for each in (condition, recording) if each)


def read(folder: Path | str, observer: str) -> list[Course]:
    """Read the courses of one observer.

    Args:
        folder: of the sweep.
        observer: its name.

    Returns:
        Each trial.

    Raises:
        ValueError: for a folder without such courses, or a table that was altered.
        OSError: where it cannot be read.
    """
    path = validate.path("folder of a sweep", folder) / "trials.csv"
    if not path.is_file():
        raise ValueError(f"{path} is not there: it must be a folder of haptic-slam evaluate --courses")
    courses, observers = [], dict[str, None]()
    for row in _rows(path):
        observers[row["observer"]] = None
        if row["observer"] == observer:
            courses.append(_course(path, row))
    if not courses:
        validate.choice(f"observer of {path}", observer, observers)
    return courses


def together(courses: Sequence[Course]) -> dict[str, Any]:
    """Put trials in order.

    Args:
        courses: of one observer, in one sweep or several.

    Returns:
        What `haptic_lab.people.courses.Courses` is made of.

    Raises:
        ValueError: where they are of other names.
    """
    names = courses[0].names
    other = next((each.names for each in courses if each.names != names), None)
    if other is not None:
        raise ValueError(f"all must be of the same names, got {validate.listed(names)} and {validate.listed(other)}")
    found: dict[tuple[str, str], dict[float, dict[int, Array]]] = {}
    for course, condition in zip(courses, conditions_in(courses), strict=True):
        of_seed = found.setdefault((course.object, condition), {}).setdefault(course.sigma, {})
        known = of_seed.get(course.seed)
        if known is None or len(known) < len(course.log_posterior):
            of_seed[course.seed] = course.log_posterior
    sigmas = sorted({sigma for of_sigma in found.values() for sigma in of_sigma})
    repeats = [of_seed for of_sigma in found.values() for of_seed in of_sigma.values()]
    length = max(len(each) for of_seed in repeats for each in of_seed.values())
    shape = len(found), len(sigmas), max(map(len, repeats)), length, len(names)
    log_posterior = np.full(shape, np.nan)
    for cell, of_sigma in enumerate(found.values()):
        for sigma, of_seed in of_sigma.items():
            for repeat, seed in enumerate(sorted(of_seed)):
                mine = of_seed[seed]
                log_posterior[cell, sigmas.index(sigma), repeat, : len(mine)] = mine
    return {
        "names": names,
        "objects": tuple(name for name, _ in found),
        "conditions": tuple(condition for _, condition in found),
        "sigmas": np.array(sigmas),
        "seconds": np.round(log_courses.SECONDS * np.arange(length), 9),
        "log_posterior": log_posterior,
    }


def _rows(path: Path) -> Iterator[dict[str, str]]:
    """Each whole row by the names of columns."""
    csv.field_size_limit(2**24)
    with path.open(encoding="utf-8-sig", newline="") as file:
        lines = csv.reader(file)
        header = next(lines, [])
        needed = ("sigma_deg", "shape", "seed", "observer")
        if header[-1:] != [CHECK] or any(name not in header for name in needed):
            raise ValueError(f"{path}, line 1: these are not the columns of a sweep")
        if log_courses.COLUMN not in header:
            raise ValueError(f"{path} has no courses: run haptic-slam evaluate with --courses")
        damaged = None
        for fields in lines:
            if damaged is not None:
                break
            if not fields:
                continue
            if len(fields) != len(header) or checksum(fields[:-1]) != fields[-1]:
                damaged = lines.line_num  # which the last line may be, of a sweep that was killed
                continue
            yield dict(zip(header, fields, strict=True))
        else:
            return
        raise ValueError(f"{path}, line {damaged}: it was altered, as its {CHECK} says")


def _course(path: Path, row: Mapping[str, str]) -> Course:
    names = tuple(name.removeprefix("p_") for name in row if name.startswith("p_"))
    try:
        numbers = np.array(row[log_courses.COLUMN].split(), dtype=np.float64).reshape(-1, len(names))
        total = np.logaddexp.reduce(numbers, axis=1)
        if not len(numbers) or not (np.abs(total) < CLOSE).all():
            raise ValueError("its probabilities do not add to 1")
        told = {name: row.get(name, str(UNTOLD.get(name, ""))) for name in FACTORS}
        where = row["shape"], told, float(row["sigma_deg"]), int(row["seed"])
        return Course(*where, names, np.asarray(log_softmax(numbers, axis=1)))
    except ValueError as error:
        raise ValueError(f"{path}: the course of seed {row['seed']} is none ({error})") from error


def conditions_in(courses: Sequence[Course]) -> list[str]:
    """Say under which condition each trial was.

    Args:
        courses: of a sweep.

    Returns:
        Of each what its trial table calls it, its recording, and those factors that vary besides.
    """
    of_label: dict[str, list[Course]] = {}
    for each in courses:
        of_label.setdefault(each.told["condition"], []).append(each)
    factors = [name for name in FACTORS if name not in APART]
    varied = {
        label: [name for name in factors if len({each.told[name] for each in mine}) > 1]
        for label, mine in of_label.items()
    }
    found = []
    for each in courses:
        label = each.told["condition"]
        also = [f"{name}={each.told[name]}" for name in varied[label]]
        found.append(" ".join([*filter(None, [condition_of(label, each.told["recording"])]), *also]))
    return found
