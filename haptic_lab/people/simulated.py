"""Simulated people: subjects of known parameters, whose tables are as those of people.

A subject explores as the repeats of the courses did, each of which is dealt once before any is dealt again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import softmax

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_lab.people import evidence
from haptic_lab.people.courses import Courses
from haptic_lab.people.decisions import Decision, choices
from haptic_lab.people.models import PARAMETERS, RULES, Model
from haptic_lab.people.stopping import Stopping, first_beyond, moments
from haptic_lab.people.trial_columns import DEADLINE

NAME = "simulated {}"
TRUTH = "true_{}"  # a column for each parameter


@dataclass(frozen=True)
class Subject:
    """Who is simulated.

    Attributes:
        sigma_deg: degrees, noise of felt angles.
        decision: how it answers.
    """

    sigma_deg: float
    decision: Decision

    @property
    def truth(self) -> dict[str, float]:
        """Of each parameter of the models."""
        told = {"sigma_deg": self.sigma_deg} | {name: getattr(self.decision, name) for name in PARAMETERS[1:]}
        return {name: value for name, value in told.items() if name not in RULES or self.decision.stops}


def subject_of(values: Mapping[str, float]) -> Subject:
    """Make a subject.

    Args:
        values: `sigma_deg`, and what of `Decision` is not as the ideal's.

    Returns:
        The subject.

    Raises:
        ValueError: for a value out of its range.
    """
    others = {name: value for name, value in values.items() if name != "sigma_deg"}
    if others.get("stop_at") == math.inf:  # of a model that tells of no such bound
        del others["stop_at"]
    return Subject(validate.number("sigma_deg", values["sigma_deg"], above=0.0, unit="degrees"), Decision(**others))


def drawn(model: Model, rng: np.random.Generator) -> Subject:
    """Draw a subject.

    Args:
        model: whose ranges the parameters are drawn from, as they are probable beforehand.
        rng: that draws.

    Returns:
        The subject.
    """
    return subject_of({name: grid.drawn(rng) for name, grid in model.grids.items()})


def halves(courses: Courses, rng: np.random.Generator, share: float = 0.5) -> tuple[Courses, Courses]:
    """Part the repeats, so that who is simulated by the ones is fitted by the others.

    Args:
        courses: with R repeats, two at least.
        rng: that draws which, of each cell apart.
        share: of them that the first part has.

    Returns:
        Two parts of the courses.

    Raises:
        ValueError: for a single repeat.
    """
    if courses.repeats < 2:
        raise ValueError(f"courses must have 2 repeats at least to be parted, got {courses.repeats}")
    first = min(max(round(share * courses.repeats), 1), courses.repeats - 1)
    order = np.array([rng.permutation(courses.repeats) for _ in courses.objects])[:, None, :, None, None]
    shuffled = np.take_along_axis(courses.log_posterior, order, axis=2)
    return (
        replace(courses, log_posterior=shuffled[:, :, :first]),
        replace(courses, log_posterior=shuffled[:, :, first:]),
    )


def simulate(
    courses: Courses,
    subject: Subject,
    trials: int,
    seconds: Sequence[float],
    rng: np.random.Generator,
    *,
    name: str = NAME.format(1),
) -> pd.DataFrame:
    """Let a subject answer.

    Args:
        courses: of the ideal observer.
        subject: who answers.
        trials: n; cells and times come equally often, in an order by chance.
        seconds: s, after which it is asked; one that stops by itself answers then at the latest (`deadline`).
        rng: of chance.
        name: of the subject.

    Returns:
        (n,) trials, as `read_trials` has them, with the truth in further columns.

    Raises:
        ValueError: for times or a sigma that the courses do not have.
    """
    validate.integer("trials", trials, 1, 1_000_000)
    asked_at = np.unique(evidence.check_times(courses, seconds))
    if not asked_at.size:
        raise ValueError("seconds must name one time at least")
    level = evidence.between(courses.sigmas, [subject.sigma_deg])[0]
    decision, at = subject.decision, evidence.times(courses)
    held = np.nan_to_num(evidence.held(courses, decision.memory_seconds))
    felt = np.flatnonzero(level)  # of a sigma between two of the courses: each in its share of the trials
    there = ~np.asarray(np.isnan(courses.log_posterior[..., 0][:, level > 0.0]).any(axis=1))  # (M, R, T)
    cells, times = _design(len(courses.objects), asked_at, trials, rng)
    decks = _Decks(there, courses, rng)
    bounds = {time: Stopping(held, at, time).bounds(*decision.rule) for time in asked_at.tolist() if decision.stops}
    rows: list[dict[str, Any]] = []
    for trial, (cell, time) in enumerate(zip(cells, times, strict=True), 1):
        at_sigma = int(felt[0] if len(felt) == 1 else rng.choice(felt, p=level[felt]))
        course = held[cell, at_sigma, decks.deal(cell, time)]  # (T, C)
        when = moments(at, time) if decision.stops else np.array([time])
        believed = np.stack([np.interp(when, at, course[:, name]) for name in range(course.shape[1])], axis=1)
        last = 0
        if decision.stops:
            best = softmax(believed, axis=1).max(axis=1)
            last = int(np.argmax(first_beyond(best[:, None, None], bounds[time][:, [at_sigma]])[:, 0, 0]))
        chosen = choices(believed[last], decision.decision_noise)
        guess = rng.random() < decision.lapse
        response = int(rng.choice(len(chosen), p=None if guess else chosen / chosen.sum()))
        confidence = 1.0 / len(chosen) if guess else float(softmax(believed[last])[response])
        row = {
            "subject": name,
            "object": courses.objects[cell],
            "response": courses.names[response],
            "seconds": round(float(when[last]), 6),
            "condition": courses.conditions[cell],
            "confidence": round(confidence, 4),
        }
        if decision.stops:
            row |= {"response_time": row["seconds"], DEADLINE: round(float(time), 6)}
        rows.append(row | {"trial": trial, **{TRUTH.format(key): value for key, value in subject.truth.items()}})
    table = pd.DataFrame(rows)
    return table if any(courses.conditions) else table.drop(columns="condition")


def _design(cells: int, seconds: Array, trials: int, rng: np.random.Generator) -> tuple[NDArray[np.intp], Array]:
    """Which cell is explored for how long: all alike often, as far as trials reach."""
    pairs = [(cell, time) for cell in range(cells) for time in seconds]
    whole, rest = divmod(trials, len(pairs))
    chosen = [*pairs * whole, *(pairs[index] for index in rng.permutation(len(pairs))[:rest])]
    order = rng.permutation(trials)
    return np.array([cell for cell, _ in chosen], dtype=np.intp)[order], np.array([time for _, time in chosen])[order]


class _Decks:
    """Repeats of each cell, shuffled, and shuffled again when all have been dealt."""

    def __init__(self, there: NDArray[np.bool_], courses: Courses, rng: np.random.Generator) -> None:
        self._there, self._courses, self._rng = there, courses, rng
        self._left: dict[int, list[int]] = {}

    def deal(self, cell: int, time: float) -> int:
        """A repeat of a cell that lasts long enough."""
        until = min(int(np.searchsorted(self._courses.seconds, time - evidence.LATE)), len(self._courses.seconds) - 1)
        valid = {int(each) for each in np.flatnonzero(self._there[cell, :, until])}
        if not valid:
            raise ValueError(f"no repeat of {self._courses.objects[cell]} lasts {time:g} s")
        left = self._left.setdefault(cell, [])
        found = next((each for each in left if each in valid), None)
        if found is None:
            left += [int(each) for each in self._rng.permutation(sorted(valid))]
            found = left[0] if left[0] in valid else next(each for each in left if each in valid)
        left.remove(found)
        return found
