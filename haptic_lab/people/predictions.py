"""What fitted models expect beside what was answered."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from haptic_lab.analysis.statistics import share_interval
from haptic_lab.people import evidence, stopping
from haptic_lab.people.fitting import Fit

COLUMNS = ["subject", "object", "condition", "seconds", "trials", "right", "low", "high", "expected"]


def predicted(fits: Mapping[str, Fit]) -> pd.DataFrame:
    """Put down what the models expect beside what was answered.

    Args:
        fits: by subject.

    Returns:
        A row for each subject, object, condition and time that has a right answer: `trials`; `right`, the share of
        right answers, with its 95 % interval (Wilson); and `expected`, the model's. Of models that tell when a subject
        answers, `right` is the share of all trials that were answered rightly by then.
    """
    rows = []
    for subject, each in fits.items():
        for cell, seconds, whole, count, expected in _by_then(each) if each.model.timed else _when_asked(each):
            thing, condition = each.model.courses.cells[cell]
            where = {"subject": subject, "object": thing, "condition": condition, "seconds": seconds, "trials": whole}
            low, high = share_interval(count, whole)
            rows.append({**where, "right": count / whole, "low": low, "high": high, "expected": expected})
    return pd.DataFrame(rows, columns=COLUMNS)


def _when_asked(fit: Fit) -> Iterator[tuple[int, float, int, int, float]]:
    """Of each cell and time: trials, those that were right, and the share that was expected."""
    answers = fit.answers
    trials = np.bincount(answers.question, answers.count, len(answers.cells))
    for question in np.flatnonzero(answers.right >= 0):
        right = answers.right[question]
        told = round(float(trials[question])), round(float(answers.count[right])), float(fit.expected[right])
        yield int(answers.cells[question]), float(answers.seconds[question]), *told


def _by_then(fit: Fit) -> Iterator[tuple[int, float, int, int, float]]:
    """Likewise of what was answered by the end of each bin of time."""
    answers, courses = fit.answers, fit.model.courses
    edges = float(courses.seconds[-1]) * stopping.SHARES
    trials = np.bincount(answers.question, answers.count, len(answers.cells))
    came = np.append(edges, np.inf)[answers.bin]
    came = np.where(np.isinf(came), answers.seconds[answers.question], came)
    names = {name: index for index, name in enumerate(courses.names)}
    for cell in dict.fromkeys(answers.cells.tolist()):
        mine: Any = answers.cells[answers.question] == cell
        right = mine & (answers.response == names.get(courses.objects[cell], -1))
        whole = round(float(trials[answers.cells == cell].sum()))
        if not right.any() or not whole:
            continue
        for edge in edges:
            by_then = right & (came <= edge + evidence.LATE)
            expected = float((fit.expected * trials[answers.question])[by_then].sum()) / whole
            yield cell, round(float(edge), 3), whole, round(float(answers.count[by_then].sum())), expected
