"""Find the parameters of a model from a subject's answers: the posterior on a grid, which misses no second maximum.

Shapes: as in `haptic_lab.people.likelihood`: J answers, B draws of repeats, F × Q × N × X × P × L values of parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import gammaln, logsumexp

from haptic_env import readable, validate
from haptic_env.arrays import Array
from haptic_lab.people import answers as counting
from haptic_lab.people import likelihood, repeats
from haptic_lab.people.answers import Answers
from haptic_lab.people.likelihood import Predicted
from haptic_lab.people.models import PARAMETERS, Model

DRAWS = 32
OF_REPEATS = 0.5  # of the repeats, as which what is known of answers with times counts: those of several times are few
SHARES = (0.025, 0.5, 0.975)


@dataclass(frozen=True, eq=False)
class Fit:
    """A model, fitted to a subject.

    Attributes:
        model: that was fitted.
        answers: to which.
        marginals: of each parameter the probability of each step of its grid.
        best: of each parameter, at the most probable values together.
        log_likelihood: nats, of all trials, at these.
        log_evidence: nats, of all trials, averaged over all values.
        expected: (J,) probability of each answer, averaged over the posterior.
        left_out: (J,) nats, log probability of each answer to whoever is told all trials but one with it.
        effective_draws: of repeats; where they are few, more repeats are needed.
    """

    model: Model
    answers: Answers
    marginals: dict[str, Array]
    best: dict[str, float]
    log_likelihood: float
    log_evidence: float
    expected: Array
    left_out: Array
    effective_draws: float

    __repr__ = readable.line

    @property
    def trials(self) -> int:
        """How many were fitted."""
        return len(self.answers.of_trial)

    def interval(self, name: str) -> tuple[float, float, float]:
        """Estimate a parameter.

        Args:
            name: of it.

        Returns:
            The median of the posterior, and the two ends of its 95 % interval, of 2.5 % each side.

        Raises:
            ValueError: for a name that is none.
        """
        validate.choice("parameter", name, PARAMETERS)
        low, median, high = self.model.grids[name].quantiles(self.marginals[name], SHARES)
        return float(median), float(low), float(high)

    @property
    def cross_validated(self) -> Array:
        """(n,) nats, log probability of each trial's answer to whoever is told all others."""
        return np.asarray(self.left_out[self.answers.of_trial])


def fit(
    model: Model,
    table: pd.DataFrame | Answers,
    *,
    draws: int = DRAWS,
    seed: int = 0,
    predicted: Predicted | None = None,
) -> Fit:
    """Fit a model to one subject.

    Args:
        model: to be fitted.
        table: (n,) trials, as `read_trials` has them, or the answers of them.
        draws: of repeats' weights, over which the posterior is averaged; 0: as if the repeats were all that can be.
        seed: of the draws.
        predicted: of `likelihood.predicted`, where it is known from before.

    Returns:
        The fit.

    Raises:
        ValueError: for trials that the courses do not have.
    """
    validate.integer("draws", draws, 0, 10_000)
    validate.seed(seed)
    answers = table if isinstance(table, Answers) else counting.answers_of(table, model.courses, model.timed)
    if predicted is None:
        predicted = _predicted(model, answers, draws, seed)
    count = len(answers.count)
    strength = OF_REPEATS * model.courses.repeats if answers.timed else None
    size = tuple(len(grid.values) for grid in model.grids.values())
    prior = 1.0 / np.prod(size)
    sures, guesses = predicted
    total = np.empty(len(sures))
    posterior = np.empty((len(sures), *size))
    expected, inverse = (np.empty((len(sures), count)) for _ in range(2))
    most, best = -np.inf, np.zeros(len(size), dtype=np.intp)
    for draw, sure in enumerate(sures):
        fits, tops = np.empty(size), np.empty(size[0])
        sums = np.empty((2, size[0], count))
        for level, probability in enumerate(
            likelihood.probabilities(model, sure, None if guesses is None else guesses[draw])
        ):  # one sigma: to fit into a cache
            fits[level] = _log_likelihood(probability, answers, strength)
            tops[level] = fits[level].max()
            each, flat = probability.reshape(-1, count), np.exp(fits[level] - tops[level]).astype(np.float32)
            sums[:, level] = flat.reshape(-1) @ each, flat.reshape(-1) @ (1.0 / _told_others(each, answers, strength))
        if (largest := float(tops.max())) > most:
            most, best = largest, np.array(np.unravel_index(int(np.argmax(fits)), size))
        weights = np.exp(fits - largest)
        total[draw] = largest + np.log(weights.sum() * prior)
        posterior[draw] = weights / weights.sum()
        expected[draw], inverse[draw] = np.exp(tops - largest) @ sums / weights.sum()
    evidence = float(logsumexp(total) - np.log(len(total)))
    worth = np.exp(total - total.max())
    worth /= worth.sum()
    together = np.tensordot(worth, posterior, axes=1)
    marginals = {
        name: together.sum(axis=tuple(axis for axis in range(len(size)) if axis != at))
        for at, name in enumerate(PARAMETERS)
    }
    return Fit(
        model,
        answers,
        marginals,
        {name: float(grid.values[index]) for (name, grid), index in zip(model.grids.items(), best, strict=True)},
        most,
        evidence,
        worth @ expected,
        -np.log(worth @ inverse),
        float(1.0 / (worth**2).sum()),
    )


def _predicted(model: Model, answers: Answers, draws: int, seed: int) -> Predicted:
    """What is predicted, of draws of the repeats; of answers with times these are averaged over in closed form."""
    return likelihood.predicted(model, answers, repeats.draws(model.courses, 0 if answers.timed else draws, seed))


def _log_likelihood(probability: NDArray[np.float32], answers: Answers, strength: float | None) -> Array:
    """Nats of all trials, of (…, J) probabilities."""
    if strength is None:
        return np.asarray(np.log(probability) @ answers.count.astype(np.float32))
    given = np.flatnonzero(answers.count)
    count, known = answers.count[given], strength * probability[..., given].astype(np.float64)
    whole = np.bincount(answers.question, answers.count)
    # Averaged over all shares that may be behind those of so many repeats, which are of Dirichlet's distribution.
    return np.asarray(
        (gammaln(known + count) - gammaln(known)).sum(axis=-1) - (gammaln(strength + whole) - gammaln(strength)).sum()
    )


def _told_others(probability: NDArray[np.float32], answers: Answers, strength: float | None) -> NDArray[Any]:
    """(…, J) probability of an answer to whoever is told all other trials, which tell of the shares too."""
    if strength is None:
        return probability
    whole = np.bincount(answers.question, answers.count)[answers.question]
    return np.asarray(
        (strength * probability + np.maximum(answers.count - 1.0, 0.0)) / (strength + np.maximum(whole - 1.0, 0.0))
    )


class Prepared:
    """A model that is fitted to one subject after the other, asked at the same times."""

    __repr__ = readable.line

    def __init__(self, model: Model, seconds: Sequence[float], *, draws: int = DRAWS, seed: int = 0) -> None:
        """Compute what is the same for all.

        Args:
            model: to be fitted.
            seconds: s, at which subjects are asked.
            draws: as of `fit`.
            seed: as of `fit`.

        Raises:
            ValueError: for times that the courses do not have.
        """
        self.model = model
        self.answers = counting.every_answer(model.courses, seconds, model.timed)
        self.predicted = _predicted(model, self.answers, draws, seed)

    def fit(self, table: pd.DataFrame) -> Fit:
        """Fit it to one subject.

        Args:
            table: (n,) trials, as `read_trials` has them.

        Returns:
            The fit.

        Raises:
            ValueError: for a trial of another time.
        """
        return fit(self.model, counting.counted(self.answers, table, self.model.courses), predicted=self.predicted)
