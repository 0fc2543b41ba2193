"""What observers answer where stimuli are compared, and their thresholds.

An observer that knows the standard and the comparison beforehand has felt one of them: the log of the ratio of their
posterior probabilities says for which the evidence is (the other candidates of the sweep take from both alike). Of m
intervals, in one of which the comparison is, it names the one where that is largest: no answer is right more often. Of
one interval it says "comparison" where the ratio favours it.

n explorations of the standard and n of each comparison make n trials a comparison: how often they are right is found
from all that can be put together but those of one seed, in which the hand moves alike and feels the same noise. That
is surer than n trials are, but the standard is the same for all comparisons; 95 % intervals hold the truth as often.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from haptic_env.arrays import Array
from haptic_lab.people.psychometric import GRID, NoThreshold, estimate, fitted
from haptic_lab.people.studies.presets import Published, Study

GROUPS = ["condition", "observer", "seconds", "sigma_deg"]
LEAST = 1e-300  # probability
ENDS = ["threshold", "low", "high"]
COUNTS = [*GROUPS, "value", "correct", "trials"]


def evidence(rows: pd.DataFrame, shape: str, standard: str) -> Array:
    """Say for which of two stimuli what was felt speaks.

    Args:
        rows: (n) of the table of trials.
        shape: the comparison, a candidate.
        standard: the standard, another.

    Returns:
        (n,) nats for the comparison.

    Raises:
        ValueError: where they were no candidates.
    """
    for name in (shape, standard):
        if f"p_{name}" not in rows:
            raise ValueError(f"{name!r} was no candidate of this sweep: it has no column p_{name}")
    ours, theirs = (np.log(np.maximum(rows[f"p_{name}"].to_numpy(float), LEAST)) for name in (shape, standard))
    return np.asarray(ours - theirs)


def right(comparison: Array, standards: Array, intervals: int) -> tuple[float, int]:
    """Let an observer answer.

    Args:
        comparison: (n,) evidence for the comparison where that was felt.
        standards: (n,) where the standard was, of the same seeds.
        intervals: of a trial.

    Returns:
        How many answers are right, on average over all trials that can be put together, and how many there are: none
        where there are fewer explorations than intervals.
    """
    if intervals == 1:
        return int((comparison > 0).sum() + (standards <= 0).sum()), len(comparison) + len(standards)
    count = min(len(comparison), len(standards))
    if count < intervals:
        return 0, 0
    apart = np.arange(1, count - intervals + 2)[:, None] + np.arange(intervals - 1)  # of what is felt in one trial
    others = standards[(np.arange(count)[:, None, None] + apart) % count].max(axis=2)
    return count * float((comparison[:count, None] > others).mean()), count


def counted(rows: pd.DataFrame, study: Study) -> pd.DataFrame:
    """Count the right answers.

    Args:
        rows: of the tables of trials, with `condition`.
        study: a discrimination.

    Returns:
        A line for each of `COUNTS`: `value` of the comparison, `correct` and `trials`.

    Raises:
        ValueError: where a stimulus was no candidate.
    """
    lines = []
    for names, group in rows.groupby(GROUPS, sort=False):
        felt = {shape: mine.sort_values("seed") for shape, mine in group.groupby("shape")}
        standards = felt.get(study.standard_shape)
        for value, shape in study.comparisons:
            if standards is None or shape not in felt:
                continue
            both = felt[shape], standards
            if study.intervals > 1:
                seeds = {*felt[shape]["seed"]} & {*standards["seed"]}
                both = felt[shape][felt[shape]["seed"].isin(seeds)], standards[standards["seed"].isin(seeds)]
            ours, theirs = (evidence(each, shape, study.standard_shape) for each in both)
            correct, trials = right(ours, theirs, study.intervals)
            lines.append((*names, value, round(correct), trials))
    return pd.DataFrame(lines, columns=COUNTS)


def thresholds(counts: pd.DataFrame, study: Study) -> pd.DataFrame:
    """Fit a Weibull function of the distance from the standard to each observer, by psignifit.

    Args:
        counts: of `counted`.
        study: a discrimination.

    Returns:
        A line for each of `GROUPS`: `threshold`, a value of the parameter, where half of what can be better than a
        guess is right, `low` and `high` of its 95 % interval (by distance from the standard), `lapse`, the number of
        `trials`, whether it is `within` the stimuli, and the share that was `right`; NaN where no threshold can be
        fitted.

    Raises:
        ValueError: for counts that psignifit cannot take.
        ImportError: where psignifit is missing.
    """
    lines = []
    for names, group in counts[counts["trials"] > 0].groupby(GROUPS, sort=False):
        distance = np.abs(group["value"].to_numpy(float) - study.standard)
        sign = math.copysign(1.0, group["value"].iloc[0] - study.standard)
        at, lapse = _fit(distance, group["correct"].to_numpy(), group["trials"].to_numpy(), max(study.intervals, 2))
        trials = int(group["trials"].sum())
        within = bool(distance.min() <= at[0] <= distance.max())
        lines.append((*names, *(study.standard + sign * at), lapse, trials, within, group["correct"].sum() / trials))
    return pd.DataFrame(lines, columns=[*GROUPS, *ENDS, "lapse", "trials", "within", "right"])


def _fit(distance: Array, correct: Array, trials: Array, alternatives: int) -> tuple[Array, float]:
    """The threshold and the ends of its interval (3,), and the rate of lapses; NaN where there is none."""
    # d' grows as the distance does, or nearly: of a choice among two the share of right answers is then Weibull's
    # function to 0.01, which no Gaussian of the distance, or of its log, is.
    data = np.column_stack([np.log(distance), correct, trials])
    how = {"sigmoid": "gumbel", "experiment_type": f"{alternatives}AFC", "grid_steps": {**GRID, "gamma": 1}}
    try:
        found = fitted(data, "a threshold", **how)  # which is Weibull's of the distance
    except NoThreshold:
        return np.full(3, math.nan), math.nan
    return np.exp(estimate(found, "threshold")), estimate(found, "lambda").value


def reached(lines: pd.DataFrame, published: Published, standard: float) -> Iterator[dict[str, Any]]:
    """Find the noise at which observers have a threshold of people.

    Args:
        lines: of `thresholds`.
        published: of people.
        standard: of the study.

    Yields:
        For each condition, observer and duration: `sigma_deg` at which its threshold is theirs, between those at which
        it was measured, `low` and `high` where the ends of its interval are, NaN where that is not so at any of them;
        and whether it is `better` at all of them.
    """
    aim = math.log(abs(published.value - standard))
    for names, group in lines.groupby(GROUPS[:-1], sort=False):
        line = group.sort_values("sigma_deg")
        sigma = line["sigma_deg"].to_numpy(float)
        distances = [(line[each] - standard).abs().to_numpy(float) for each in ("threshold", "high", "low")]
        crossings = [_crossing(sigma, each, aim) for each in distances]
        told = dict(zip([*GROUPS[:-1], "sigma_deg", "low", "high"], [*names, *crossings], strict=True))
        yield told | {"better": bool((distances[0] < math.exp(aim)).all())}


def _crossing(sigma: Array, distance: Array, aim: float) -> float:
    """Where a curve over log sigma first reaches exp(aim) from below; NaN where it does not."""
    logs = np.log(np.maximum(distance, LEAST)) - aim
    for i in range(len(logs) - 1):
        if logs[i] <= 0 < logs[i + 1]:
            share = -logs[i] / (logs[i + 1] - logs[i])
            return float(np.exp((1 - share) * np.log(sigma[i]) + share * np.log(sigma[i + 1])))
    return math.nan
