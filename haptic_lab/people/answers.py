"""What a subject answered, put so that models can be held against it.

Shapes: K questions (a cell asked about at a time), J answers (a question with a response, and where the subject
answers when it likes, with the bin of time in which it does), M cells, C names.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_lab.people import evidence, stopping
from haptic_lab.people.courses import Courses
from haptic_lab.people.sweep_courses import condition_of
from haptic_lab.people.trial_columns import DEADLINE


@dataclass(frozen=True, eq=False)
class Answers:
    """What a subject answered, alike trials together; and, of questions with a right answer, that too.

    Attributes:
        cells: (K,) of the questions.
        seconds: (K,) s, when they were asked, at the latest.
        question: (J,) of each answer.
        response: (J,) its name.
        bin: (J,) of the time when it came, of `stopping.bins`; all 0 where it was asked for.
        count: (J,) trials with it, or 0.
        right: (K,) the answer that is right; -1 where none is, and where answers have times.
        of_trial: (n,) the answer of each trial.
        timed: whether it came when the subject liked.
    """

    cells: NDArray[np.intp]
    seconds: Array
    question: NDArray[np.intp]
    response: NDArray[np.intp]
    bin: NDArray[np.intp]
    count: Array
    right: NDArray[np.intp]
    of_trial: NDArray[np.intp]
    timed: bool

    @property
    def bins(self) -> int:
        """How many times of an answer are told apart."""
        return stopping.BINS if self.timed else 1


def answers_of(table: pd.DataFrame, courses: Courses, timed: bool = False) -> Answers:
    """Count the answers of a table.

    Args:
        table: (n,) trials of one subject, as `read_trials` has them.
        courses: of which each trial is one.
        timed: whether the subject answered when it liked, after `deadline` at the latest, a column of the table;
            without one, when the courses end.

    Returns:
        The answers.

    Raises:
        ValueError: for an object, a response or a time that the courses do not have; it names the trial.
    """
    names = {name: index for index, name in enumerate(courses.names)}
    asked = list(_asked(table, courses, timed))
    questions = {each: index for index, each in enumerate(dict.fromkeys(each[:2] for each in asked))}
    found: dict[tuple[int, int, int], int] = {}
    of_trial = [
        found.setdefault((questions[cell, seconds], bin_, response), len(found))
        for cell, seconds, bin_, response in asked
    ]
    right = []
    for (cell, _), question in questions.items():
        name = names.get(courses.objects[cell])
        bins = range(stopping.BINS) if timed and name is not None else ()
        right.append(-1 if timed or name is None else found.setdefault((question, 0, name), len(found)))
        for bin_ in bins:  # of which what is expected is told beside what was answered
            found.setdefault((question, bin_, names[courses.objects[cell]]), len(found))
    keys, given = np.array(list(questions)), np.array(list(found), dtype=np.intp)
    trials = np.array(of_trial, dtype=np.intp)
    return Answers(
        cells=keys[:, 0].astype(np.intp),
        seconds=keys[:, 1],
        question=given[:, 0],
        response=given[:, 2],
        bin=given[:, 1],
        count=np.bincount(trials, minlength=len(found)).astype(np.float64),
        right=np.array(right, dtype=np.intp),
        of_trial=trials,
        timed=timed,
    )


def every_answer(courses: Courses, seconds: Sequence[float], timed: bool = False) -> Answers:
    """List all answers that there can be, none of which was given yet.

    Args:
        courses: each cell of which is asked about.
        seconds: s, when it is, at the latest.
        timed: whether subjects answer when they like.

    Returns:
        The answers: of each question C of each time, in the order of the names.
    """
    times = np.unique(evidence.check_times(courses, seconds))
    cells = np.repeat(np.arange(len(courses.objects)), len(times))
    size = len(cells), stopping.BINS if timed else 1, len(courses.names)
    question, bin_, response = (each.ravel() for each in np.indices(size))
    names = {name: index for index, name in enumerate(courses.names)}
    right = [
        -1 if timed or courses.objects[cell] not in names else index * len(names) + names[courses.objects[cell]]
        for index, cell in enumerate(cells)
    ]
    none = np.empty(0, dtype=np.intp)
    moments = np.tile(times.round(6), len(courses.objects))
    return Answers(cells, moments, question, response, bin_, np.zeros(len(question)), np.array(right), none, timed)


def counted(every: Answers, table: pd.DataFrame, courses: Courses) -> Answers:
    """Count the answers of a table among all that there can be.

    Args:
        every: of `every_answer`.
        table: (n,) trials, of the same cells and times.
        courses: of which each trial is one.

    Returns:
        The answers.

    Raises:
        ValueError: for a trial that is none of them.
    """
    asked = np.array(list(_asked(table, courses, every.timed)))
    place = {each: index for index, each in enumerate(zip(every.cells.tolist(), every.seconds.tolist(), strict=True))}
    if not {*zip(asked[:, 0], asked[:, 1], strict=True)} <= set(place):
        raise ValueError(f"trials must be asked after {validate.listed(sorted(set(every.seconds.tolist())))} s")
    questions = np.array([place[cell, seconds] for cell, seconds in asked[:, :2].tolist()])
    of_trial = ((questions * every.bins + asked[:, 2]) * len(courses.names) + asked[:, 3]).astype(np.intp)
    return replace(every, of_trial=of_trial, count=np.bincount(of_trial, minlength=len(every.count)).astype(np.float64))


def _asked(table: pd.DataFrame, courses: Courses, timed: bool) -> Iterator[tuple[int, float, int, int]]:
    """Cell, seconds of the question, bin of the time of the answer, and answer of each trial."""
    conditions = table["condition"] if "condition" in table else [""] * len(table)
    recordings = table["recording"] if "recording" in table else [""] * len(table)
    deadlines = table[DEADLINE] if DEADLINE in table else [np.nan] * len(table)
    last = float(courses.seconds[-1])
    names = {name: index for index, name in enumerate(courses.names)}
    columns = zip(table["object"], table["response"], table["seconds"], deadlines, conditions, recordings, strict=True)
    for row, (thing, response, seconds, deadline, condition, recording) in enumerate(columns):
        told = f"trial {table['trial'].iloc[row]} of subject {table['subject'].iloc[row]}" if "trial" in table else row
        try:
            cell = courses.cell(thing, condition_of(condition, recording))
            evidence.check_times(courses, [seconds])
            validate.choice("response", response, names)
            until, bin_ = float(seconds), 0
            if timed:
                until = last if np.isnan(deadline) else float(evidence.check_times(courses, [deadline])[0])
                if seconds > until + evidence.LATE:
                    raise ValueError(f"seconds must be no later than the {DEADLINE}, {until:g} s, got {seconds:g}")
                bin_ = int(stopping.bin_of(np.array([seconds]), until, last)[0])
        except ValueError as error:
            raise ValueError(f"{told}: {error}") from error
        yield cell, round(until, 6), bin_, names[response]
