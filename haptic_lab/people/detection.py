"""Theory of signal detection: d′, criterion, and efficiency against an observer, with their 95 % intervals.

B draws. A share of k in n trials, of which 1/m would be right by chance, is estimated as (k + 1/m) / (n + 1): of yes–no
rates that is the log-linear correction (m = 2; Hautus 1995), so that no d′ is infinite. Intervals are percentiles of a
Bayesian bootstrap over trials (Rubin 1981) that holds this one trial more: the share is Beta(k + 1/m, n - k + 1 - 1/m).
d′ of a choice of m is by Hacker & Ratcliff (1979): the share that is right is ∫ φ(x - d′) Φ(x)^(m - 1) dx.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.optimize import brentq

from haptic_env import readable, validate
from haptic_env.arrays import Array

DRAWS = 2000
ENDS = (0.025, 0.975)
FARTHEST = 12.0  # of d′; beyond it no double tells the share from 1
MOST_ALTERNATIVES = 1000
STEPS = np.linspace(-FARTHEST, FARTHEST, 241)  # SD, at which the smooth integrand is summed to all digits


class Sensitivity(NamedTuple):
    """How well signals are told from noise, or alternatives from each other.

    Attributes:
        d_prime: corrected, in SDs of the noise.
        criterion: c, in SDs of the noise: positive where "no" is favoured; NaN where alternatives are chosen from.
        d_prime_draws: (B,) of the bootstrap.
        criterion_draws: (B,) likewise.
        trials: how many it was found in.
        perfect: whether every trial was right, so that d′ is bounded from below alone.
    """

    d_prime: float
    criterion: float
    d_prime_draws: Array
    criterion_draws: Array
    trials: int
    perfect: bool

    def __repr__(self) -> str:
        return readable.line(self)

    @property
    def d_prime_interval(self) -> tuple[float, float]:
        """The two ends of the 95 % interval of d′; the upper one is infinite where every trial was right."""
        low, high = _ends(self.d_prime_draws)
        return low, math.inf if self.perfect else high

    @property
    def criterion_interval(self) -> tuple[float, float]:
        """The two ends of the 95 % interval of the criterion."""
        return _ends(self.criterion_draws)


class Efficiency(NamedTuple):
    """(d′ of people / d′ of an observer)².

    Attributes:
        value: the best estimate; NaN where the observer or all people made no mistake, as their d′ is not known then.
        low: the lower end of its 95 % interval, or, where people alone made no mistake, what the efficiency is above
            of with 95 %; NaN where there is one person alone in a group.
        high: the upper end, or, where the observer alone made no mistake, what the efficiency is below of with 95 %;
            infinite where people made no mistake.
    """

    value: float
    low: float
    high: float


def share_correct(d_prime: ArrayLike, alternatives: int) -> Array:
    """Say how often the right one of several alternatives is chosen without bias.

    Args:
        d_prime: (…) SDs of the noise, of the one alternative that is the signal.
        alternatives: m.

    Returns:
        (…) shares.

    Raises:
        ValueError: for numbers out of range.
    """
    given = validate.numbers("d_prime", d_prime)
    count = validate.integer("alternatives", alternatives, 2, MOST_ALTERNATIVES)
    return _share_correct(given, count)


def d_prime_of(share: float, alternatives: int) -> float:
    """Say how far apart alternatives are, of which the right one is chosen so often.

    Args:
        share: in (0, 1).
        alternatives: m.

    Returns:
        d′ in SDs of the noise, at most ± 12; negative below chance.

    Raises:
        ValueError: for numbers out of range.
    """
    value = validate.number("share", share, high=1.0, above=0.0)
    if value == 1.0:
        raise ValueError("share must be a finite number in (0, 1), got 1.0, at which d′ is infinite")
    return _d_prime(value, validate.integer("alternatives", alternatives, 2, MOST_ALTERNATIVES))


def yes_no(hits: int, signals: int, false_alarms: int, noises: int, *, seed: int = 0) -> Sensitivity:
    """Estimate d′ = z(H) - z(F) and c = -(z(H) + z(F)) / 2 of answers of yes and no.

    Args:
        hits: "yes" among the signals.
        signals: trials with one.
        false_alarms: "yes" among the others.
        noises: trials without.
        seed: of the bootstrap.

    Returns:
        The estimate, in which signals and others are drawn apart.

    Raises:
        ValueError: for counts that cannot be.
    """
    h, n = _counted("hits", hits, "signals", signals)
    f, m = _counted("false_alarms", false_alarms, "noises", noises)
    rng = np.random.default_rng(validate.seed(seed))
    drawn = stats.norm.ppf([rng.beta(k + 0.5, total - k + 0.5, DRAWS) for k, total in ((h, n), (f, m))])
    of_h, of_f = (float(stats.norm.ppf((k + 0.5) / (total + 1.0))) for k, total in ((h, n), (f, m)))
    return Sensitivity(
        of_h - of_f, -0.5 * (of_h + of_f), drawn[0] - drawn[1], -0.5 * drawn.sum(axis=0), n + m, h == n and f == 0
    )


def forced_choice(correct: int, trials: int, alternatives: int, *, seed: int = 0) -> Sensitivity:
    """Estimate d′ of choices among several alternatives.

    Args:
        correct: right choices.
        trials: all choices.
        alternatives: m, to choose from in each.
        seed: of the bootstrap.

    Returns:
        The estimate, without a criterion.

    Raises:
        ValueError: for counts that cannot be.
    """
    k, n = _counted("correct", correct, "trials", trials)
    m = validate.integer("alternatives", alternatives, 2, MOST_ALTERNATIVES)
    drawn = np.random.default_rng(validate.seed(seed)).beta(k + 1.0 / m, n - k + 1.0 - 1.0 / m, DRAWS)
    draws = np.interp(drawn, *_course(m))  # to 1e-3 of d′
    return Sensitivity(_d_prime((k + 1.0 / m) / (n + 1.0), m), math.nan, draws, np.full(DRAWS, math.nan), n, k == n)


def efficiency(people: Sensitivity | Sequence[Sensitivity], observer: Sensitivity, *, seed: int = 0) -> Efficiency:
    """Hold people against an observer: (d′ of people / d′ of the observer)², and 0 where people are below chance.

    Args:
        people: one person, with an interval over their trials, or a group, of which d′ is the mean over subjects, with
            an interval over these.
        observer: in the same task, with an interval over its trials.
        seed: of the bootstrap.

    Returns:
        The efficiency.

    Raises:
        ValueError: for no people at all.
    """
    if isinstance(people, Sensitivity):
        value, draws, perfect = people.d_prime, people.d_prime_draws, people.perfect
    else:
        if not people:
            raise ValueError("people must be one person at least, got none")
        each = np.array([person.d_prime for person in people])
        value, perfect = float(each.mean()), all(person.perfect for person in people)
        draws = group_draws(each, np.array([person.d_prime_draws.std() for person in people]), seed=seed)
    # Draws of both are of their own generators: in another order they belong to no other draw of their kind.
    of_observer = np.random.default_rng(validate.integer("seed", seed, 0) + 1).permutation(observer.d_prime_draws)
    with np.errstate(divide="ignore", invalid="ignore"):
        drawn = np.square(np.maximum(draws, 0.0) / np.maximum(of_observer, 0.0))
    drawn = np.where(np.isnan(drawn) & np.isfinite(draws), math.inf, drawn)
    if perfect:
        low = 0.0 if observer.perfect else float(np.quantile(drawn, 0.05, method="inverted_cdf"))
        return Efficiency(math.nan, low, math.inf)
    if observer.perfect:
        return Efficiency(math.nan, 0.0, float(np.quantile(drawn, 0.95, method="inverted_cdf")))
    best = max(value, 0.0) ** 2 / observer.d_prime**2 if observer.d_prime > 0.0 else math.nan
    return Efficiency(best, *_ends(drawn))


def group_draws(values: Array, within: Array, *, seed: int = 0) -> Array:
    """Draw the mean over subjects again and again, by a bootstrap over them.

    The draws are as wide as Student's t over subjects has the mean, and no narrower than their own trials leave it: a
    few subjects may be alike by chance.

    Args:
        values: (N,) of subjects.
        within: (N,) standard errors of each, from their trials.
        seed: of the bootstrap.

    Returns:
        (B,) means; NaN of fewer than two subjects, who say nothing of others.
    """
    count = len(values)
    if count < 2:
        return np.full(DRAWS, math.nan)
    rng = np.random.default_rng(validate.seed(seed))
    means = values[rng.integers(count, size=(DRAWS, count))].mean(axis=1)
    apart = means - means.mean()
    if apart.std() < 1e-12:
        apart = rng.normal(size=DRAWS)
    few = float(stats.t.ppf(ENDS[1], count - 1) / stats.norm.ppf(ENDS[1]))  # of whom the spread is not known well
    error = max(few * float(values.std(ddof=1)), math.sqrt(float(np.mean(within**2)))) / math.sqrt(count)
    return np.asarray(values.mean() + apart * (error / apart.std()))


def _ends(draws: Array) -> tuple[float, float]:
    if np.isnan(draws).any():
        return math.nan, math.nan
    low, high = np.quantile(draws, ENDS, method="inverted_cdf")  # some may be infinite
    return float(low), float(high)


def _counted(what: str, part: int, of_what: str, whole: int) -> tuple[int, int]:
    total = validate.integer(of_what, whole, 1, 2**53)
    return validate.integer(f"{what} of {total} {of_what}", part, 0, total), total


def _share_correct(d_prime: Array, alternatives: int) -> Array:
    """∫ φ(x - d′) Φ(x)^(m - 1) dx, with x - d′ in `STEPS`."""
    others = np.exp((alternatives - 1) * stats.norm.logcdf(STEPS + d_prime[..., None]))
    return np.asarray((stats.norm.pdf(STEPS) * others).sum(axis=-1) * (STEPS[1] - STEPS[0]))


@lru_cache(maxsize=64)
def _course(alternatives: int) -> tuple[Array, Array]:
    """Shares, ascending, and the d′ of each."""
    d_prime = np.linspace(-FARTHEST, FARTHEST, 1201)
    return _share_correct(d_prime, alternatives), d_prime


@lru_cache(maxsize=4096)
def _d_prime(share: float, alternatives: int) -> float:
    def miss(d_prime: float) -> float:
        return float(_share_correct(np.array(d_prime), alternatives)) - share

    if miss(-FARTHEST) >= 0.0 or miss(FARTHEST) <= 0.0:
        return math.copysign(FARTHEST, share - 1.0 / alternatives)
    return float(brentq(miss, -FARTHEST, FARTHEST, xtol=1e-9))
