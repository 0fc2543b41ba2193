"""How well an observer says what people answered, trial by trial. M trials, C answers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy import stats
from sklearn.metrics import cohen_kappa_score

from haptic_env import validate
from haptic_env.arrays import Array

FLOOR = 0.02  # how often an answer is any at all: no single one can cost more than ln(C / 0.02) nats
DRAWS = 1000


class Correlation(NamedTuple):
    """Spearman's rank correlation.

    Attributes:
        rho: in [-1, 1]; NaN where either is the same in all trials.
        low: the lower end of its 95 % interval, of a bootstrap over trials.
        high: the upper end.
        trials: how many.
    """

    rho: float
    low: float
    high: float
    trials: int


def log_likelihoods(
    responses: Sequence[str], probabilities: ArrayLike, answers: Sequence[str], floor: float = FLOOR
) -> Array:
    """Say how probable an observer holds what people answered, if people answer as often as it believes.

    Args:
        responses: (M,) of people, among the answers.
        probabilities: (M, C) that the observer gives to each answer.
        answers: (C,) that there were to choose from.
        floor: how often an answer is any at all, whatever is believed: log((1 - floor) p + floor / C).

    Returns:
        (M,) nats.

    Raises:
        ValueError: for what is none of these.
    """
    chosen = _chosen(responses, answers)
    given = _distributions("probabilities", probabilities, len(responses), len(answers))
    lapse = validate.number("floor", floor, 0.0, 1.0)
    with np.errstate(divide="ignore"):  # without a floor it may be impossible
        return np.log((1.0 - lapse) * given[np.arange(len(chosen)), chosen] + lapse / len(answers))


def kappa(responses: Sequence[str], answered: ArrayLike, answers: Sequence[str]) -> float:
    """Give Cohen's κ between people and an observer.

    Args:
        responses: (M,) of people, among the answers.
        answered: (M, C) how often the observer would give each answer in the trial: of one answer 1, and of several
            repeats their shares.
        answers: (C,) that there were to choose from.

    Returns:
        κ, 1 where all agree, 0 where they do as often as by chance; NaN where both always say one and the same.

    Raises:
        ValueError: for what is none of these.
    """
    trial, theirs, weights = _pairs(responses, answered, answers)
    if len(np.unique(np.concatenate([trial, theirs]))) < 2:
        return math.nan
    return float(cohen_kappa_score(trial, theirs, sample_weight=weights))


def shared_bits(responses: Sequence[str], answered: ArrayLike, answers: Sequence[str]) -> float:
    """Give the mutual information of people's answers and an observer's.

    Args:
        responses: (M,) as of `kappa`.
        answered: (M, C) likewise.
        answers: (C,) likewise.

    Returns:
        Bits. What is found in M trials by chance alone is about (C - 1)² / (2 M ln 2) bits.

    Raises:
        ValueError: for what is none of these.
    """
    trial, theirs, weights = _pairs(responses, answered, answers)
    table = np.zeros((len(answers), len(answers)))
    np.add.at(table, (trial, theirs), weights)
    of_each, of_both = (
        (stats.entropy(table.sum(axis=axis), base=2) for axis in (0, 1)),
        stats.entropy(table.ravel(), base=2),
    )
    return max(float(sum(of_each) - of_both), 0.0)  # scikit-learn's takes counts for whole numbers


def time_correlation(one: ArrayLike, other: ArrayLike, *, seed: int = 0) -> Correlation:
    """Correlate times of trials by their ranks.

    Args:
        one: (M,) s, infinite where there was no decision; NaN where nothing is known of a trial.
        other: (M,) s likewise.
        seed: of the bootstrap.

    Returns:
        The correlation over trials of which both are known.

    Raises:
        ValueError: for what is none of these.
    """
    first, second = (validate.real(each) for each in (one, other))
    if first is None or second is None or first.ndim != 1 or first.shape != second.shape:
        told = [validate.shown(each) for each in (one, other)]
        raise ValueError(f"one and other must be times of the same trials, got {told[0]} and {told[1]}")
    known = ~(np.isnan(first) | np.isnan(second))
    ranks = [stats.rankdata(each[known]) for each in (first, second)]
    count = int(known.sum())
    if count < 3 or any(np.ptp(each) == 0.0 for each in ranks):
        return Correlation(math.nan, math.nan, math.nan, count)
    chosen = np.random.default_rng(validate.seed(seed)).integers(count, size=(DRAWS, count))
    drawn = [stats.rankdata(each[chosen], axis=1) for each in ranks]
    a, b = (each - each.mean(axis=1, keepdims=True) for each in drawn)
    spread = np.sqrt((a * a).sum(axis=1) * (b * b).sum(axis=1))
    rho = (a * b).sum(axis=1)[spread > 0.0] / spread[spread > 0.0]
    low, high = np.quantile(rho, (0.025, 0.975))
    return Correlation(float(stats.spearmanr(*ranks).statistic), float(low), float(high), count)


def _chosen(responses: Sequence[str], answers: Sequence[str]) -> np.ndarray:
    index = {name: number for number, name in enumerate(validate.names("answers", answers))}
    given = validate.names("responses", list(responses) if isinstance(responses, pd.Series) else responses)
    stranger = next((each for each in given if each not in index), None)
    if stranger is not None:
        raise ValueError(f"responses must be among {validate.listed(answers)}, got {validate.shown(stranger)}")
    return np.array([index[each] for each in given])


def _distributions(what: str, value: ArrayLike, trials: int, answers: int) -> Array:
    given = validate.array(what, value, (trials, answers))
    if (given < 0.0).any() or not np.allclose(given.sum(axis=1), 1.0, atol=1e-6):
        raise ValueError(f"{what} must be shares that add to 1 in each trial, got {validate.shown(given)}")
    return given


def _pairs(responses: Sequence[str], answered: ArrayLike, answers: Sequence[str]) -> tuple[np.ndarray, ...]:
    """Each answer of a trial with each that the observer would give there, and how often it would."""
    chosen = _chosen(responses, answers)
    shares = _distributions("answered", answered, len(responses), len(answers))
    trials, theirs = np.nonzero(shares)
    return chosen[trials], theirs, shares[trials, theirs]
