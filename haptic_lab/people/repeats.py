"""How repeats stand for all the explorations that might have been.

Shapes: K questions (a cell asked about at a time), B draws, S sigmas, R repeats, M cells, C names; D explorations: the
repeats of all C cells of one condition.

The share of a cell's own repeats with some answer is a poor estimate where repeats are few: an answer that none gave
seems impossible. But an exploration of another object that an observer takes for this one tells how this one would be
answered. By Bayes' rule, explorations of all names, each weighed by the posterior probability of the object, are
explorations of the object; the observer's posterior is sharpened or blunted first so that it is calibrated. This
second estimate is mixed with the first as if it were `BORROWED` repeats more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax, softmax

from haptic_env.arrays import Array
from haptic_lab.people import evidence
from haptic_lab.people.courses import Courses

BORROWED = 30.0  # repeats as which the other objects' count
LENT = 0.7  # of what is known of answers with times: they are so many that an object's own repeats tell little of each
SHARPNESS = np.geomspace(0.05, 4.0, 24)  # exponents of the posterior, among which the calibrated one is found


class Weighed(NamedTuple):
    """Explorations that answer the questions asked at one time under one condition.

    Attributes:
        questions: (k,) of the K.
        cells: (c,) whose repeats they are.
        seconds: s, when it is asked.
        weights: (k, S, B, c·R), adding to 1 over explorations.
    """

    questions: NDArray[np.intp]
    cells: NDArray[np.intp]
    seconds: float
    weights: NDArray[np.float32]


def draws(courses: Courses, count: int, seed: int) -> Array:
    """Draw how much each repeat counts (the Bayesian bootstrap, Rubin 1981).

    Args:
        courses: with M cells of R repeats.
        count: B; 0: one draw, in which all count alike.
        seed: of the draws.

    Returns:
        (B, M, R); 1 on average.
    """
    size = (len(courses.objects), courses.repeats)
    if count == 0:
        return np.ones((1, *size))
    return np.random.default_rng(seed).exponential(size=(count, *size))


def weighed(courses: Courses, cells: NDArray[np.intp], seconds: Array, drawn: Array) -> list[Weighed]:
    """Weigh explorations for questions.

    Args:
        courses: of the ideal observer.
        cells: (K,) of the questions.
        seconds: (K,) s, when they are asked.
        drawn: (B, M, R) of `draws`.

    Returns:
        The questions of each condition and time, with the explorations that answer them.

    Raises:
        ValueError: where no repeat lasts as long.
    """
    held, at = evidence.held(courses), evidence.times(courses)
    conditions = np.array(courses.conditions, dtype=object)[cells]
    found = []
    for condition, time in dict.fromkeys(zip(conditions, seconds.tolist(), strict=True)):
        questions = np.flatnonzero((conditions == condition) & (seconds == time))
        named = _named(courses, condition)
        if named is not None:
            believed = evidence.asked(held, at, named, np.full(len(named), time))  # (C, S, R, C)
            found.append(_borrowing(courses, questions, cells, named, time, believed, drawn))
            questions = questions[~np.isin(cells[questions], named)]
        for question in questions:  # of objects beside the candidates, which nothing can be borrowed for
            own = cells[[question]]
            believed = evidence.asked(held, at, own, np.array([time]))
            there = ~np.isnan(believed[0, ..., 0])  # (S, R)
            alone = drawn[:, own[0]] * there[:, None]  # (S, B, R)
            found.append(Weighed(np.array([question]), own, time, _normalised(alone, courses, own[0], time)[None]))
    return [each for each in found if each.questions.size]


def when_stopped(part: Weighed, named: NDArray[np.intp], courses: Courses, believed: Array) -> NDArray[np.float32]:
    """Weigh explorations by what was believed when each was stopped.

    Args:
        part: questions and explorations of one time and condition.
        named: (k,) the cells of its questions.
        courses: of the ideal observer.
        believed: (c, S, R, C) nats, when explorations were stopped, by whatever rule.

    Returns:
        (k, S, 1, c·R) weights as those of the part, which stay as they are where nothing can be borrowed.
    """
    if len(part.cells) != len(courses.names):
        return part.weights
    there = ~np.isnan(believed[..., 0]).transpose(1, 0, 2)  # (S, C, R)
    posterior = _calibrated(np.nan_to_num(believed), there)
    weights = np.empty((len(named), len(there), 1, there[0].size), dtype=np.float32)
    for row, cell in enumerate(named):
        name = int(np.flatnonzero(part.cells == cell)[0])
        own = np.zeros(there.shape)
        own[:, name] = there[:, name] / np.maximum(there[:, name].sum(axis=1, keepdims=True), 1)
        lent = there * posterior[..., name]
        lent /= np.maximum(lent.sum(axis=(1, 2), keepdims=True), 1e-300)
        weights[row] = ((1.0 - LENT) * own + LENT * lent).reshape(len(there), 1, -1)
    return weights


def _named(courses: Courses, condition: str) -> NDArray[np.intp] | None:
    """(C,) the cell of each name under a condition; None where one was not explored."""
    there = {thing: cell for cell, (thing, under) in enumerate(courses.cells) if under == condition}
    return np.array([there[name] for name in courses.names]) if all(name in there for name in courses.names) else None


def _borrowing(
    courses: Courses,
    questions: NDArray[np.intp],
    cells: NDArray[np.intp],
    named: NDArray[np.intp],
    time: float,
    believed: Array,
    drawn: Array,
) -> Weighed:
    mine = questions[np.isin(cells[questions], named)]
    there = ~np.isnan(believed[..., 0]).transpose(1, 0, 2)  # (S, C, R)
    posterior = _calibrated(np.nan_to_num(believed), there)  # (S, C, R, C)
    weights = np.empty((len(mine), *there.shape[:1], len(drawn), there[0].size), dtype=np.float32)
    valid = there[:, None] * drawn[:, named]  # (S, B, C, R)
    share = BORROWED / (BORROWED + courses.repeats)
    for row, question in enumerate(mine):
        name = int(np.flatnonzero(named == cells[question])[0])
        own = np.zeros_like(valid)
        own[:, :, name] = _normalised(valid[:, :, name], courses, int(cells[question]), time)
        lent = valid * posterior[:, None, ..., name]
        lent /= np.maximum(lent.sum(axis=(2, 3), keepdims=True), 1e-300)
        weights[row] = ((1.0 - share) * own + share * lent).reshape(*weights.shape[1:])
    return Weighed(mine, named, time, weights)


def _calibrated(believed: Array, there: NDArray[np.bool_]) -> Array:
    """(S, C, R, C) posteriors (C, S, R, C), of which each sigma has the sharpness that tells the objects best."""
    nats = believed.transpose(1, 0, 2, 3)
    names = np.arange(nats.shape[-1])
    scores = np.empty((len(SHARPNESS), len(nats)))
    for row, sharpness in enumerate(SHARPNESS):
        right = np.maximum(log_softmax(sharpness * nats, axis=-1)[:, names, :, names], evidence.LEAST)  # (C, S, R)
        scores[row] = (right.transpose(1, 0, 2) * there).sum(axis=(1, 2))
    return np.asarray(softmax(SHARPNESS[scores.argmax(axis=0), None, None, None] * nats, axis=-1))


def _normalised(weights: Array, courses: Courses, cell: int, time: float) -> NDArray[np.float32]:
    """Weights (S, B, R) that add to 1 over repeats."""
    whole = weights.sum(axis=-1, keepdims=True)
    if not (whole > 0.0).all():
        thing, under = courses.cells[cell]
        raise ValueError(f"no repeat of {thing}{f' under {under}' if under else ''} lasts {time:g} s at every sigma")
    return (weights / whole).astype(np.float32)
