"""How probable a subject's answers are under a model, for all values of its parameters at once.

Shapes: K questions (a cell asked about at a time), J answers (a question with a response), B draws of repeats,
S sigmas, F, Q, N, L values of sigma, memory, decision noise and lapse; R repeats, M cells, C names.

What an answer's probability is comes from R explorations, which is a sample: how these stand for all that might have
been is uncertain (`haptic_lab.people.repeats`). What is said of the parameters is averaged over draws of how much each
counts, a draw by how well it explains the answers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_lab.people import evidence, repeats
from haptic_lab.people.courses import Courses
from haptic_lab.people.decisions import choices
from haptic_lab.people.models import Model
from haptic_lab.people.sweep_courses import condition_of

LEAST = 1e-9  # of a probability: no answer is impossible


@dataclass(frozen=True, eq=False)
class Answers:
    """What a subject answered, alike trials together; and, of questions with a right answer, that too.

    Attributes:
        cells: (K,) of the questions.
        seconds: (K,) s, when they were asked.
        question: (J,) of each answer.
        response: (J,) its name.
        count: (J,) trials with it, or 0.
        right: (K,) the answer that is right; -1 where none is.
        of_trial: (n,) the answer of each trial.
    """

    cells: NDArray[np.intp]
    seconds: Array
    question: NDArray[np.intp]
    response: NDArray[np.intp]
    count: Array
    right: NDArray[np.intp]
    of_trial: NDArray[np.intp]


def answers_of(table: pd.DataFrame, courses: Courses) -> Answers:
    """Count the answers of a table.

    Args:
        table: (n,) trials of one subject, as `read_trials` has them.
        courses: of which each trial is one.

    Returns:
        The answers.

    Raises:
        ValueError: for an object, a response or a time that the courses do not have; it names the trial.
    """
    conditions = table["condition"] if "condition" in table else [""] * len(table)
    recordings = table["recording"] if "recording" in table else [""] * len(table)
    names = {name: index for index, name in enumerate(courses.names)}
    questions: dict[tuple[int, float], int] = {}
    found: dict[tuple[int, int], int] = {}
    of_trial = []
    columns = zip(table["object"], table["response"], table["seconds"], conditions, recordings, strict=True)
    for row, (thing, response, seconds, condition, recording) in enumerate(columns):
        told = f"trial {table['trial'].iloc[row]} of subject {table['subject'].iloc[row]}" if "trial" in table else row
        try:
            cell = courses.cell(thing, condition_of(condition, recording))
            evidence.check_times(courses, [seconds])
            validate.choice("response", response, names)
        except ValueError as error:
            raise ValueError(f"{told}: {error}") from error
        question = questions.setdefault((cell, round(float(seconds), 6)), len(questions))
        of_trial.append(found.setdefault((question, names[response]), len(found)))
    right = []
    for (cell, _), question in questions.items():
        name = names.get(courses.objects[cell])
        right.append(-1 if name is None else found.setdefault((question, name), len(found)))
    trials = np.array(of_trial, dtype=np.intp)
    asked, given = np.array(list(questions)), np.array(list(found), dtype=np.intp)
    return Answers(
        cells=asked[:, 0].astype(np.intp),
        seconds=asked[:, 1],
        question=given[:, 0],
        response=given[:, 1],
        count=np.bincount(trials, minlength=len(found)).astype(np.float64),
        right=np.array(right, dtype=np.intp),
        of_trial=trials,
    )


def every_answer(courses: Courses, seconds: Sequence[float]) -> Answers:
    """List all answers that there can be, none of which was given yet.

    Args:
        courses: each cell of which is asked about.
        seconds: s, when it is.

    Returns:
        The answers: of each question C, in the order of the names.
    """
    times = np.unique(evidence.check_times(courses, seconds))
    cells = np.repeat(np.arange(len(courses.objects)), len(times))
    count = len(courses.names)
    question, response = np.divmod(np.arange(len(cells) * count), count)
    names = {name: index for index, name in enumerate(courses.names)}
    right = [
        -1 if courses.objects[cell] not in names else index * count + names[courses.objects[cell]]
        for index, cell in enumerate(cells)
    ]
    none = np.empty(0, dtype=np.intp)
    moments = np.tile(times.round(6), len(courses.objects))
    return Answers(cells, moments, question, response, np.zeros(len(question)), np.array(right), none)


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
    given = answers_of(table, courses)
    place = {each: index for index, each in enumerate(zip(every.cells.tolist(), every.seconds.tolist(), strict=True))}
    asked = list(zip(given.cells.tolist(), given.seconds.tolist(), strict=True))
    if not set(asked) <= set(place):
        raise ValueError(f"trials must be asked after {validate.listed(sorted(set(every.seconds.tolist())))} s")
    questions = np.array([place[each] for each in asked])
    index = questions[given.question] * len(courses.names) + given.response
    of_trial = index[given.of_trial]
    return replace(every, of_trial=of_trial, count=np.bincount(of_trial, minlength=len(every.count)).astype(np.float64))


def predicted(model: Model, answers: Answers, drawn: Array) -> NDArray[np.float32]:
    """Say how probable answers are to whoever never lapses.

    Args:
        model: with S sigmas, and Q memories and N decision noises to be tried.
        answers: of a subject.
        drawn: (B, M, R) how much repeats count, of `repeats.draws`.

    Returns:
        (B, Q, N, J, S) probabilities.

    Raises:
        ValueError: where no repeat lasts as long as a trial.
    """
    courses, grids = model.courses, model.grids
    memories, noises = grids["memory_seconds"].values, grids["decision_noise"].values
    shape = (len(drawn), len(memories), len(noises), len(answers.question), len(courses.sigmas))
    result = np.empty(shape, dtype=np.float32)
    parts = repeats.weighed(courses, answers.cells, answers.seconds, drawn)
    at = evidence.times(courses)
    for q, memory in enumerate(memories):
        held = evidence.held(courses, memory)
        for part in parts:
            asked = evidence.asked(held, at, part.cells, np.full(len(part.cells), part.seconds))  # (c, S, R, C)
            for n, noise in enumerate(noises):
                chosen = np.nan_to_num(choices(asked, noise)).astype(np.float32).transpose(1, 0, 2, 3)
                share = part.weights @ chosen.reshape(1, len(courses.sigmas), -1, chosen.shape[-1])  # (k, S, B, C)
                for row, question in enumerate(part.questions):
                    mine = np.flatnonzero(answers.question == question)
                    result[:, q, n, mine] = share[row][..., answers.response[mine]].transpose(1, 2, 0)
    return result


def probabilities(model: Model, of_draw: NDArray[np.float32]) -> Iterator[NDArray[np.float32]]:
    """Say how probable answers are at all values of the parameters.

    Args:
        model: with F sigmas and L lapses to be tried.
        of_draw: (Q, N, J, S) of `predicted`.

    Yields:
        (Q, N, L, J) for each of the F sigmas.
    """
    grids, guess = model.grids, 1.0 / len(model.courses.names)
    between = evidence.between(model.courses.sigmas, grids["sigma_deg"].values).astype(np.float32)
    lapse = grids["lapse"].values.astype(np.float32)[:, None]
    for levels in between:
        sure = (of_draw @ levels)[..., None, :]  # (Q, N, 1, J)
        yield np.maximum((1.0 - lapse) * sure + lapse * np.float32(guess), np.float32(LEAST))
