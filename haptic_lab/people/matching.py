"""Observers in people's trials: what each would have answered, in the same cells as often as people were there.

M trials of people, C answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from haptic_env.arrays import Array
from haptic_lab.people.observed import Cell, Observed
from haptic_lab.people.scoring import NO, YES, Design


class Match(NamedTuple):
    """An observer beside people.

    Attributes:
        label: of the observer.
        answers: a row for each of its own trials: `object`, `condition`, `seconds`, `response`, `weight`, by which
            its cells are as frequent as people's, and `exploration`, of which it is, as it may be of several times.
        probabilities: (M, C) of each answer as it believes, the mean over its trials in this cell; NaN where it has
            none.
        answered: (M, C) how often it would give each answer, likewise.
        decided: (M,) s, median from when on it is sure, infinite where it is not; NaN where it has no trial.
        missing: of people's cells, those that it did not explore.
    """

    label: str
    answers: pd.DataFrame
    probabilities: Array
    answered: Array
    decided: Array
    missing: tuple[Cell, ...]

    @property
    def known(self) -> np.ndarray:
        """(M,) whether it explored what people did."""
        return ~np.isnan(self.probabilities[:, 0])


def cells_of(table: pd.DataFrame) -> list[Cell]:
    """Say what was explored in each trial.

    Args:
        table: (M,) trials.

    Returns:
        (M,) cells.
    """
    empty = [""] * len(table)
    columns = [table.get(name, empty) for name in Cell._fields]
    return [
        Cell(str(name), str(under), str(path), float(time)) for name, under, path, time in zip(*columns, strict=True)
    ]


def match(table: pd.DataFrame, design: Design, observer: Observed) -> Match:
    """Put an observer in the place of people.

    Args:
        table: (M,) trials.
        design: what was asked.
        observer: whose answers these are.

    Returns:
        What it would have answered.
    """
    cells, take = cells_of(table), _answers(design, observer.names, table)
    shape = len(table), len(design.answers)
    probabilities, answered, decided = np.full(shape, np.nan), np.full(shape, np.nan), np.full(len(table), np.nan)
    rows, missing = [], []
    trials_of: dict[Cell, list[int]] = {}
    for trial, cell in enumerate(cells):
        trials_of.setdefault(cell, []).append(trial)
    for cell, trials in trials_of.items():
        found = observer.find(cell)
        believed = found.posterior @ take if found is not None else np.zeros((0, shape[1]))
        whole = believed.sum(axis=1) > 0.0
        if found is None or not whole.any():
            missing.append(cell)
            continue
        believed = believed[whole] / believed[whole].sum(axis=1, keepdims=True)
        best = believed.argmax(axis=1)
        probabilities[trials] = believed.mean(axis=0)
        answered[trials] = np.bincount(best, minlength=shape[1]) / len(best)
        decided[trials] = np.sort(found.decided[whole])[len(best) // 2]  # a median that may be infinite
        share = len(trials) / len(best)
        where = cell.object, cell.condition, cell.seconds
        rows += [
            (*where, design.answers[each], share, f"{number} {cell.recording}")
            for each, number in zip(best, found.explorations[whole], strict=True)
        ]
    answers = pd.DataFrame(rows, columns=["object", "condition", "seconds", "response", "weight", "exploration"])
    return Match(observer.label, answers, probabilities, answered, decided, tuple(missing))


def unknown_to(observer: Observed, design: Design) -> list[str]:
    """Say which names an observer could not choose, though people could.

    Args:
        observer: whose names these are.
        design: what was asked.

    Returns:
        Those, of an identification; none of yes and no.
    """
    if design.kind != "identification":
        return []
    return [name for name in design.answers if name not in observer.names]


def _answers(design: Design, names: Sequence[str], table: pd.DataFrame) -> Array:
    """(names, C) which name is which answer."""
    take = np.zeros((len(names), len(design.answers)))
    objects = set(table["object"])
    for row, name in enumerate(names):
        if design.kind == "yes-no":
            if name in objects:
                take[row, design.answers.index(NO if name in design.absent else YES)] = 1.0
        elif name in design.answers:
            take[row, design.answers.index(name)] = 1.0
    return take
