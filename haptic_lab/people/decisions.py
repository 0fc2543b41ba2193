"""From what an ideal observer believed to what a subject answers.

Shapes: as in `Courses`: M cells, S sigmas, R repeats, T times, C names.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_lab.people import evidence
from haptic_lab.people.courses import Courses
from haptic_lab.people.stopping import Stopping

TIE = 1e-9  # nats, by which two names may differ that are equally probable


@dataclass(frozen=True)
class Decision:
    """How a subject decides. As it is by default it is the ideal observer's: the most probable name.

    Attributes:
        memory_seconds: s, the time constant with which evidence fades; inf: it does not.
        decision_noise: nats, the temperature of a softmax over evidence; 0: the name with the most of it.
        lapse: the share of trials in which the answer is a guess, all names alike.
        stop_at: the probability of its best name at which it answers, if it is not asked before; None: when asked.
        price: what a second costs, as a share of the worth of a right answer; it answers as soon as to go on is not
            worth it. 0: time is free.

    Raises:
        ValueError: for a value out of its range, and for both rules of stopping at once.
    """

    memory_seconds: float = math.inf
    decision_noise: float = 0.0
    lapse: float = 0.0
    stop_at: float | None = None
    price: float = 0.0

    def __post_init__(self) -> None:
        if self.memory_seconds != math.inf:
            validate.number("memory_seconds", self.memory_seconds, above=0.0, high=1e9, unit="s, or inf")
        validate.number("decision_noise", self.decision_noise, 0.0, 1e6, unit="nats")
        validate.number("lapse", self.lapse, 0.0, 1.0)
        if self.stop_at is not None:
            validate.number("stop_at", self.stop_at, high=1.0, above=0.0)
        validate.number("price", self.price, 0.0, 1e3, unit="per second")
        if self.stops and self.stop_at is not None and self.price:
            raise ValueError(f"either stop_at or price says when it answers, got {self.stop_at:g} and {self.price:g}")

    @property
    def stops(self) -> bool:
        """Whether it may answer before it is asked."""
        return self.stop_at is not None or self.price > 0.0

    @property
    def rule(self) -> tuple[float, float]:
        """Of stopping: `stop_at`, infinite where there is none, and `price`."""
        return math.inf if self.stop_at is None else self.stop_at, self.price

    def response_probabilities(self, courses: Courses, cell: int, sigma: float, seconds: float) -> Array:
        """Say how probable each answer is, whenever it comes, if it is asked for after some time.

        Args:
            courses: of the ideal observer.
            cell: what is explored, `courses.cell(object, condition)`.
            sigma: degrees, within those of the courses.
            seconds: s, no longer than the courses.

        Returns:
            (C,) probabilities, averaged over repeats.

        Raises:
            ValueError: for a cell, a sigma or a time that the courses do not have.
        """
        return self.answers(courses, cell, sigma, seconds)[1].sum(axis=0)

    def answers(self, courses: Courses, cell: int, sigma: float, seconds: float) -> tuple[Array, Array]:
        """Say how probable each answer is at each time.

        Args:
            courses: of the ideal observer.
            cell: what is explored, `courses.cell(object, condition)`.
            sigma: degrees, within those of the courses.
            seconds: s, when the answer is asked for, no longer than the courses.

        Returns:
            (n,) s, the times at which answers may come, the last of which is `seconds`; and (n, C) the probability of
            each answer at each of them, averaged over repeats.

        Raises:
            ValueError: for a cell, a sigma or a time that the courses do not have.
        """
        validate.integer("cell", cell, 0, len(courses.objects) - 1)
        (until,) = evidence.check_times(courses, [validate.seconds("seconds", seconds)])
        levels = evidence.between(courses.sigmas, [validate.number("sigma", sigma, above=0.0, unit="degrees")])
        held, at = evidence.held(courses, self.memory_seconds), evidence.times(courses)
        if self.stops:
            stopping = Stopping(held, at, until)
            asked, mine = stopping.seconds, stopping.held[cell]  # (n,), (n, S, R, C)
            (first,) = stopping.first(*self.rule, np.array([cell]))
            chosen = choices(mine, self.decision_noise) * first[..., None]
        else:
            asked = np.array([until])
            mine = evidence.asked(held, at, np.array([cell]), asked)
            chosen = choices(mine, self.decision_noise)
        there = ~np.isnan(mine[-1]).any(axis=-1)  # (S, R) repeats that were that long
        if not there.any(axis=1).all():
            raise ValueError(f"no repeat of {courses.objects[cell]} lasts {until:g} s")
        each = np.where(there[..., None], chosen, 0.0).sum(axis=2) / there.sum(axis=1)[:, None]  # (n, S, C)
        answered = np.einsum("s,nsc->nc", levels[0], each)
        guess = np.full(len(courses.names), 1.0 / len(courses.names))
        return asked, (1.0 - self.lapse) * answered + self.lapse * answered.sum(axis=1, keepdims=True) * guess


def choices(held: Array, decision_noise: float) -> Array:
    """Choose names from evidence.

    Args:
        held: (..., C) nats.
        decision_noise: nats, the temperature of a softmax; 0: the name with the most evidence, or by lot among such.

    Returns:
        (..., C) probability of each name; NaN where there is no evidence.
    """
    if decision_noise > 0.0:
        return softmax(held / decision_noise, axis=-1)
    with np.errstate(invalid="ignore"):
        best = (held >= held.max(axis=-1, keepdims=True) - TIE).astype(np.float64)
        return best / np.where(np.isnan(held).any(axis=-1, keepdims=True), np.nan, best.sum(axis=-1, keepdims=True))
