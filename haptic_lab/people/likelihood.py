"""How probable a subject's answers are under a model, for all values of its parameters at once.

Shapes: K questions and J answers, as in `haptic_lab.people.answers`; B draws of repeats, S sigmas; F, Q, N, X, P, L
values of sigma, memory, decision noise, the probability at which to stop, the price of time, and lapse; R repeats,
M cells, C names.

What an answer's probability is comes from R explorations, which is a sample: how these stand for all that might have
been is uncertain (`haptic_lab.people.repeats`). What is said of the parameters is averaged over draws of how much each
counts, a draw by how well it explains the answers.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_lab.people import evidence, repeats, stopping
from haptic_lab.people.answers import Answers
from haptic_lab.people.decisions import choices
from haptic_lab.people.models import Model
from haptic_lab.people.repeats import Weighed

LEAST = 1e-9  # of a probability: no answer is impossible
STRAY = 0.02  # of answers that come when the subject likes: they may be any, at any time
Floats = NDArray[np.float32]


class Predicted(NamedTuple):
    """How probable answers are to whoever never lapses.

    Attributes:
        sure: (B, Q, N, X, P, J, S).
        guess: likewise of who guesses, when the other would have answered; None: alike for all names, whenever asked.
    """

    sure: Floats
    guess: Floats | None


def predicted(model: Model, answers: Answers, drawn: Array) -> Predicted:
    """Say how probable answers are to whoever never lapses.

    Args:
        model: with S sigmas, and Q memories, N decision noises and X · P rules of stopping to be tried.
        answers: of a subject, with times where the model tells of these.
        drawn: (B, M, R) how much repeats count, of `repeats.draws`.

    Returns:
        The probabilities.

    Raises:
        ValueError: where no repeat lasts as long as a trial.
    """
    courses, grids = model.courses, model.grids
    memories, noises, bounds, prices = (
        grids[name].values for name in ("memory_seconds", "decision_noise", "stop_at", "price")
    )
    values = len(memories), len(noises), len(bounds), len(prices)
    shape = (len(drawn), *values, len(answers.question), len(courses.sigmas))
    sure, guess = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.float32) if answers.timed else None
    parts = repeats.weighed(courses, answers.cells, answers.seconds, drawn)
    at = evidence.times(courses)
    ideal = evidence.held(courses)
    for q, memory in enumerate(memories):
        held = evidence.held(courses, memory)
        for part in parts:
            if not answers.timed:
                asked = evidence.asked(held, at, part.cells, np.full(len(part.cells), part.seconds))  # (c, S, R, C)
                for n, noise in enumerate(noises):
                    _fill(sure[:, q, n, 0, 0], answers, part, _shares(part, _chosen(asked, noise))[None])
                continue
            told, known = (stopping.Stopping(each, at, part.seconds) for each in (held, ideal))
            for (x, bound), (p, price) in product(enumerate(bounds), enumerate(prices)):
                when = told.when(bound, price, part.cells)  # (c, S, R)
                asked, believed = (each.at(when, part.cells) for each in (told, known))  # (c, S, R, C)
                weights = repeats.when_stopped(part, answers.cells[part.questions], courses, believed)
                stopped, moments = part._replace(weights=weights), told.seconds[when]
                bins = stopping.bin_of(moments, part.seconds, float(at[-1]))
                for n, noise in enumerate(noises):
                    chosen = _chosen(asked, noise)
                    then = (chosen * (bins == each)[..., None] for each in range(stopping.BINS))
                    shares = np.stack([_shares(stopped, each) for each in then])
                    shares = (1.0 - STRAY) * shares + STRAY / (shares.shape[0] * shares.shape[-1])
                    guesses = np.broadcast_to(shares.mean(axis=-1, keepdims=True), shares.shape)
                    _fill(sure[:, q, n, x, p], answers, part, shares)
                    _fill(guess[:, q, n, x, p], answers, part, guesses)  # type: ignore[index]
    return Predicted(sure, guess)


def _chosen(asked: Array, noise: float) -> Floats:
    """(c, S, R, C) probability of each name; 0 where there is no evidence."""
    return np.asarray(np.nan_to_num(choices(asked, noise)).astype(np.float32))


def _shares(part: Weighed, chosen: Floats) -> Floats:
    """(k, S, B, C) how often each answer comes of explorations (c, S, R, C)."""
    chosen = chosen.transpose(1, 0, 2, 3)
    return np.asarray(part.weights @ chosen.reshape(1, chosen.shape[0], -1, chosen.shape[-1]))


def _fill(result: Floats, answers: Answers, part: Weighed, shares: Floats) -> None:
    """Put the shares (bins, k, S, B, C) of a part into (B, J, S)."""
    for row, question in enumerate(part.questions):
        mine = np.flatnonzero(answers.question == question)
        told = shares[answers.bin[mine], row, :, :, answers.response[mine]]  # (j, S, B)
        result[:, mine] = told.transpose(2, 0, 1)


def probabilities(model: Model, sure: Floats, guess: Floats | None) -> Iterator[Floats]:
    """Say how probable answers are at all values of the parameters.

    Args:
        model: with F sigmas and L lapses to be tried.
        sure: (Q, N, X, P, J, S) of `predicted`, one draw.
        guess: likewise.

    Yields:
        (Q, N, X, P, L, J) for each of the F sigmas.
    """
    grids = model.grids
    between = evidence.between(model.courses.sigmas, grids["sigma_deg"].values).astype(np.float32)
    lapse = grids["lapse"].values.astype(np.float32)[:, None]
    alike = np.float32(1.0 / len(model.courses.names))
    for levels in between:
        known = (sure @ levels)[..., None, :]
        guessed = alike if guess is None else (guess @ levels)[..., None, :]
        yield np.maximum((1.0 - lapse) * known + lapse * guessed, np.float32(LEAST))
