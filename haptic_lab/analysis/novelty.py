"""How well new objects are told from known ones, and how far the name that is given may be trusted."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from haptic_env.shapes.names import NONE
from haptic_lab.analysis.summary import ALL
from haptic_lab.conditions import factors_in
from haptic_lab.sweeps.results import labels_in, right_names

RESAMPLES = 2000
BINS = 10  # of probability


def summarise(rows: pd.DataFrame) -> pd.DataFrame:
    """Judge the probability of "none of these", and that of the name that is given.

    Args:
        rows: of the table of trials of a sweep that had `none`.

    Returns:
        Lines as of `haptic_lab.analysis.summary.summarise`, of all shapes together: `new_auroc`, how often a new object
        was found more probably new than a known one (NaN where there is none of either), and `name_ece`, how far the
        probability of the name given is from how often it is right. Intervals are of trials drawn again.
    """
    labels, groups = labels_in(rows), [*factors_in(rows.columns), "shape", "observer"]
    lines = []
    for names, group in rows.assign(shape=ALL, right=right_names(rows)).groupby(groups, sort=False):
        said = group[[f"p_{label}" for label in labels]].to_numpy(dtype=np.float64)
        true, sure = group["right"].to_numpy(), said.max(axis=1)
        new, hit = true == NONE, np.array(labels)[said.argmax(axis=1)] == true
        for measure, judge, told, what in (
            ("new_auroc", auroc, said[:, labels.index(NONE)], new),
            ("name_ece", ece, sure, hit),
        ):
            lines.append((*names, measure, *_resampled(judge, told, what), len(group)))
    return pd.DataFrame(lines, columns=[*groups, "measure", "mean", "low", "high", "trials"])


def auroc(said: NDArray[np.float64], new: NDArray[np.bool_]) -> float:
    """Measure how often a new object is found more probably new than a known one.

    Args:
        said: (n,) probability that each is new.
        new: (n,) whether it is.

    Returns:
        The area under the ROC curve, ties counting half; NaN where all are of one kind.

    References:
        Hanley & McNeil 1982, Radiology 143, 29-36.
    """
    if new.all() or not new.any():
        return math.nan
    above = stats.mannwhitneyu(said[new], said[~new], method="asymptotic").statistic
    return float(above / (new.sum() * (~new).sum()))


def ece(sure: NDArray[np.float64], hit: NDArray[np.bool_]) -> float:
    """Measure the expected calibration error, over ten bins of probability.

    Args:
        sure: (n,) probability of the name given.
        hit: (n,) whether it is right.

    Returns:
        The mean of how far a bin's mean probability is from its share of right names.
    """
    which = np.minimum((sure * BINS).astype(int), BINS - 1)
    apart = np.abs(np.bincount(which, weights=sure - hit, minlength=BINS))
    return float(apart.sum() / len(sure))


def _resampled(
    judge: Callable[[NDArray[np.float64], NDArray[np.bool_]], float], told: NDArray[np.float64], what: NDArray[np.bool_]
) -> tuple[float, float, float]:
    """What `judge` finds of all trials, and the ends of its 95 % interval."""
    drawn = np.random.default_rng(0).integers(len(told), size=(RESAMPLES, len(told)))
    values = np.array([judge(told[chosen], what[chosen]) for chosen in drawn])
    values = values[np.isfinite(values)]
    low, high = np.percentile(values, [2.5, 97.5]).tolist() if len(values) else (math.nan, math.nan)
    return judge(told, what), low, high
