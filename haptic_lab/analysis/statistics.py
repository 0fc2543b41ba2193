"""Means, medians and shares with their 95 % intervals."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import stats

FEW = 5  # trials: of fewer the interval of a share covers most of what there is, and tells nothing


def interval(values: np.ndarray) -> tuple[float, float, float, int]:
    """Estimate a mean.

    Args:
        values: (n,).

    Returns:
        Mean, the two ends of its 95 % interval (Student's t), and n; NaN where there are too few.
    """
    count = len(values)
    mean = float(values.mean()) if count else math.nan
    if count < 2:
        return mean, math.nan, math.nan, count
    half = float(stats.t.ppf(0.975, count - 1) * values.std(ddof=1) / math.sqrt(count))
    return mean, mean - half, mean + half, count


def side(low: float, high: float) -> int:
    """Say on which side of 0 an interval lies.

    Args:
        low: its one end.
        high: its other end.

    Returns:
        1 above 0, -1 below; 0 where it holds 0 or has no ends.
    """
    return int(low > 0.0) - int(high < 0.0)


def told_of_trials(trials: int, intervals: str = "95 % intervals") -> str:
    """Say what intervals a picture has.

    Args:
        trials: that a mean is of.
        intervals: what they are, where there are any.

    Returns:
        That, or that there are too few trials for it.
    """
    return intervals if trials >= FEW else f"too few for intervals, which begin at {FEW}"


def share_interval(count: int, whole: int) -> tuple[float, float]:
    """Estimate a share.

    Args:
        count: that were so.
        whole: that could have been.

    Returns:
        The two ends of its 95 % interval (Wilson); NaN of nothing.
    """
    if not whole:
        return math.nan, math.nan
    found = stats.binomtest(count, whole).proportion_ci(method="wilson")
    return float(found.low), float(found.high)


def bootstrapped(table: np.ndarray, estimate: Callable[[np.ndarray], Any]) -> tuple[float, float, float]:
    """Estimate something of a table in which the worlds are what is uncertain.

    Args:
        table: (W, S), a row for each world.
        estimate: of the numbers of rows (W, S), such as their median.

    Returns:
        The estimate of all numbers and the two ends of its 95 % interval, percentiles of 2000 resamples of the worlds.
    """
    worlds = np.arange(len(table))
    drawn = stats.bootstrap(
        (worlds,),
        lambda chosen: estimate(table[chosen]),
        n_resamples=2000,
        vectorized=False,
        method="percentile",
        rng=np.random.default_rng(0),
    ).bootstrap_distribution
    low, high = np.quantile(drawn, (0.025, 0.975), method="inverted_cdf")  # some may be infinite
    return float(estimate(table)), float(low), float(high)


def median(times: np.ndarray) -> tuple[float, float, float, int]:
    """Estimate a median.

    Args:
        times: (n,), of which some may be infinite.

    Returns:
        Median, the two ends of its 95 % interval by order statistics, and n.
    """
    ordered, count = np.sort(times), len(times)
    below = int(stats.binom.ppf(0.025, count, 0.5))
    low, high = ordered[max(below - 1, 0)], ordered[min(count - below, count - 1)]
    middle = ordered[(count - 1) // 2], ordered[count // 2]
    return float(0.5 * (middle[0] + middle[1])), float(low), float(high), count
