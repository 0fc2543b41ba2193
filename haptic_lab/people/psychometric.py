"""Psychometric functions: what share of answers against a stimulus that varies, fitted by psignifit.

L levels. ψ(x) = γ + (1 - γ - λ) Φ(x), with Φ a cumulative Gaussian, γ the rate of guesses and λ that of lapses, and
beta-binomial noise, so that answers that were not of one mind throughout make intervals wider (Schütt, Harmeling,
Macke & Wichmann 2016). Needs the extra `people`: psignifit is GPL, and is imported where it is used alone.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from haptic_env import extras, shapes, validate
from haptic_env.arrays import Array
from haptic_env.shapes import names

LEAST_LEVELS = 3  # levels that tell a threshold from a slope
WIDTH = 0.95  # the width goes from 1 - this to this, of Φ
GRID = {
    "threshold": 25,
    "width": 25,
    "lambda": 12,
    "gamma": 12,
    "eta": 8,
}  # at the full one of psignifit a fit takes 9 s


class NoThreshold(ValueError):
    """Answers that no threshold follows from: of too few levels, or all alike."""


class Estimate(NamedTuple):
    """A number with its 95 % credible interval.

    Attributes:
        value: at the largest posterior.
        low: the lower end.
        high: the upper end.
    """

    value: float
    low: float
    high: float


class Psychometric(NamedTuple):
    """A psychometric function.

    Attributes:
        threshold: the level at which Φ is 0.5, in units of the levels.
        slope: of Φ at the threshold, per unit of the levels, negative where shares fall.
        lapse: λ.
        guess: γ, exactly 1 / m of a choice among m.
        overdispersion: η, 0 where answers are as independent as the binomial has them.
    """

    threshold: Estimate
    slope: Estimate
    lapse: Estimate
    guess: Estimate
    overdispersion: Estimate

    def share(self, levels: ArrayLike) -> Array:
        """Give the function.

        Args:
            levels: (…) at which.

        Returns:
            (…) ψ of the best estimate.
        """
        z = (np.asarray(levels) - self.threshold.value) * self.slope.value * math.sqrt(2.0 * math.pi)
        return self.guess.value + (1.0 - self.guess.value - self.lapse.value) * np.asarray(norm.cdf(z))


def fit_psychometric(
    levels: ArrayLike, counted: ArrayLike, trials: ArrayLike, alternatives: int | None = None
) -> Psychometric:
    """Fit a psychometric function.

    Args:
        levels: (L,) of the stimulus; some may be there more than once.
        counted: (L,) of the trials, those with "yes", or with the right choice.
        trials: (L,) at each.
        alternatives: m of a choice among several; None: "yes" against "no", of which the guess rate is found too.

    Returns:
        The function.

    Raises:
        NoThreshold: for fewer than three levels, or answers that are all alike.
        ValueError: for what is none of these.
        ImportError: where psignifit is missing.
    """
    x = validate.numbers("levels", levels, 1)
    k = validate.array("counted", counted, x.shape)
    n = validate.array("trials", trials, x.shape)
    if (n < 0).any() or (k < 0).any() or (k > n).any() or (k % 1 != 0).any() or (n % 1 != 0).any():
        raise ValueError(f"counted and trials must be whole numbers, 0 <= counted <= trials, got {validate.shown(k)}")
    if alternatives is not None:
        validate.integer("alternatives", alternatives, 2, 1000)
    x, k, n = x[n > 0], k[n > 0], n[n > 0]
    trials_in_all = max(float(n.sum()), 1.0)
    slope = (x - n @ x / trials_in_all) @ (k - n * k.sum() / trials_in_all)
    falls = bool(slope < 0.0)
    # Mirrored: psignifit's own functions that fall have the rates of guesses and lapses change places.
    found = fitted(
        np.column_stack([-x if falls else x, k, n]),
        "a psychometric function",
        experiment_type="yes/no" if alternatives is None else f"{alternatives}AFC",
        sigmoid="norm",
        grid_steps=GRID if alternatives is None else {"gamma": 1},
    )
    return _as_ours(found, falls)


def fitted(counts: Array, what: str, **how: Any) -> Any:
    """Let psignifit fit.

    Args:
        counts: (L, 3) levels, trials that are counted, and all trials, one at least.
        what: it is needed for, for the message where it is missing.
        **how: keyword arguments of psignifit.

    Returns:
        What it found.

    Raises:
        NoThreshold: for fewer than three levels, or answers that are all alike.
        ValueError: for data that it cannot take.
        ImportError: where it is missing.
    """
    different, (counted, whole) = len(np.unique(counts[:, 0])), counts[:, 1:].sum(axis=0)
    if different < LEAST_LEVELS:
        raise NoThreshold(f"levels must be {LEAST_LEVELS} different ones at least, that were tried, got {different}")
    if counted in (0.0, whole):
        raise NoThreshold(f"counted must differ between trials, got {counted:g} of {whole:g}: no level is a threshold")
    psignifit = extras.load("psignifit", "people", what)
    try:
        return psignifit.psignifit(counts, verbose=False, **how)
    except Exception as error:  # of whatever kind it has for data that it cannot take
        raise ValueError(f"psignifit cannot fit these levels: {' '.join(str(error).split())}") from error


def level_of(objects: Sequence[str]) -> tuple[str, Mapping[str, float]]:
    """Find the one parameter that varies among objects of one family.

    Args:
        objects: names of shapes, as `shapes.check` writes them.

    Returns:
        What varies, as in "ellipsoid x", and its value for each object.

    Raises:
        ValueError: where they are of several families, or not exactly one parameter varies.
    """
    several = list(dict.fromkeys(validate.names("objects", objects)))
    told = {each: names.parsed(each) or names.Name(each, (), ()) for each in several}
    families = {each.family for each in told.values()}
    if len(families) != 1 or not families <= {*shapes.FAMILIES, *shapes.SHAPES}:
        raise ValueError(f"objects must be of one family of which one parameter varies, got {validate.listed(several)}")
    (family,) = families
    values = {each: _parameters(family, name, each) for each, name in told.items()}
    keys = dict.fromkeys(key for each in values.values() for key in each)
    varying = [key for key in keys if len({each.get(key) for each in values.values()}) > 1]
    if len(varying) != 1 or any(not isinstance(each.get(varying[0]), int | float) for each in values.values()):
        raise ValueError(
            f"objects must differ in one number alone, got {validate.listed(several)}, which differ in "
            f"{validate.listed(varying) if varying else 'none'}"
        )
    key = varying[0]
    return f"{family} {key}", {each: float(mine[key]) for each, mine in values.items()}


def _parameters(family: str, name: names.Name, whole: str) -> dict[str, Any]:
    """Of a shape by name: those of its family, where it has any, and its size in metres."""
    given = dict(name.keywords)
    size = given.pop(names.SIZE, None)
    parameters: dict[str, Any] = {}
    if family in shapes.FAMILIES:
        bound = inspect.signature(shapes.FAMILIES[family]).bind(*name.values, **given)
        bound.apply_defaults()
        parameters = dict(bound.arguments)
    largest = float(np.max(shapes.default_size(whole)))
    # Without a size said the size follows from the parameters, and is no second thing that varies.
    return parameters | ({names.SIZE: largest} if size is not None or family in shapes.SHAPES else {})


def estimate(found: Any, name: str) -> Estimate:
    """Read what psignifit found of a parameter.

    Args:
        found: of psignifit.
        name: of the parameter, as psignifit calls it.

    Returns:
        The estimate, which its interval has in it.
    """
    value = float(found.parameter_estimate[name])
    low, high = (float(end) for end in found.confidence_intervals[name]["0.95"])
    return Estimate(value, min(low, value), max(high, value))


def _as_ours(found: Any, falls: bool) -> Psychometric:
    width = estimate(found, "width")
    steepest = 2.0 * float(norm.ppf(WIDTH)) / math.sqrt(2.0 * math.pi)
    slopes = sorted((-1.0 if falls else 1.0) * steepest / each for each in (width.low, width.high) if each > 0.0)
    slope = Estimate((-1.0 if falls else 1.0) * steepest / width.value, slopes[0], slopes[-1])
    threshold, lapse, guess, overdispersion = (
        estimate(found, name) for name in ("threshold", "lambda", "gamma", "eta")
    )
    if falls:
        threshold = Estimate(-threshold.value, -threshold.high, -threshold.low)
    return Psychometric(threshold, slope, lapse, guess, overdispersion)
