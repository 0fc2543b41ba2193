"""How good a belief is. Metrics may read the truth; observers never do.

Shapes: T steps, J joints, C labels, B bins, (X, Y, Z) voxels. Angles in radians. What cannot be said (a share of
nothing) is NaN. What is given must be finite, real, of these shapes and, where it is a probability, in [0, 1]: else all
raise `ValueError`, which quotes it. Of a map and a surface: `observer.surface_metrics`, whose names are here too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri

from haptic_env import readable, validate
from haptic_env.arrays import Array
from observer.surface_metrics import TOUCH_TOLERANCE as TOUCH_TOLERANCE
from observer.surface_metrics import SurfaceScore as SurfaceScore
from observer.surface_metrics import reachable as reachable
from observer.surface_metrics import reached_into as reached_into
from observer.surface_metrics import surface_coverage as surface_coverage
from observer.surface_metrics import surface_places as surface_places
from observer.surface_metrics import surface_precision as surface_precision
from observer.surface_metrics import surface_recall as surface_recall
from observer.surface_metrics import surface_score as surface_score
from observer.surface_metrics import touched_places as touched_places
from observer.swept_volume import neighbourhood as neighbourhood
from observer.swept_volume import swept as swept

IMPOSSIBLE = 1e-6  # probability below which the log loss takes all for the same
LATEST = 1e10  # seconds: a clock that counts from 1970
MOST_BINS = 100_000
WIDEST = 1e9  # rad: an angle that has been added up for years


class Reliability(NamedTuple):
    """Calibration of probabilities.

    Attributes:
        predicted: (B,) mean of the predicted probabilities in each bin.
        observed: (B,) how often it was true.
        cells: (B,) how many cells.
        ece: expected calibration error, the mean gap between the two, weighted by cells.
        brier: Brier score, over all cells.
        log_loss: nats, over all cells, of a truth held for impossible that of one in a million.
    """

    predicted: Array
    observed: Array
    cells: NDArray[np.int64]
    ece: float
    brier: float
    log_loss: float

    def __repr__(self) -> str:
        return readable.line(self)


class Share(NamedTuple):
    """A share of trials with its interval.

    Attributes:
        mean: the share.
        low: where the interval begins.
        high: where it ends.
        trials: how many.
    """

    mean: float
    low: float
    high: float
    trials: int


# Pose


def pose_error_deg(estimate: ArrayLike, truth: ArrayLike) -> Array:
    """Tell how far a pose is off at each step.

    Args:
        estimate: (T, J) rad.
        truth: (T, J) rad.

    Returns:
        (T,) degrees, RMS over joints.

    Raises:
        ValueError: for what is none of these.
    """
    one, other = validate.together(WIDEST, estimate=estimate, truth=truth)
    if one.ndim == 0 or one.shape[-1] == 0:
        raise ValueError(f"estimate and truth must be angles of some joints (T, J), got shape {one.shape}")
    return np.rad2deg(np.sqrt(np.square(one - other).mean(axis=-1)))


def pose_rmse_deg(estimate: ArrayLike, truth: ArrayLike) -> float:
    """Tell how far a pose is off.

    Args:
        estimate: (T, J) rad.
        truth: (T, J) rad.

    Returns:
        Degrees, RMS over steps and joints.

    Raises:
        ValueError: for what is none of these.
    """
    error = pose_error_deg(estimate, truth)
    return float(np.sqrt(np.square(error).mean())) if error.size else float("nan")


def credible_coverage(mean: ArrayLike, std: ArrayLike, truth: ArrayLike, level: float = 0.9) -> float:
    """Tell how often the central interval of a Gaussian holds the truth.

    Args:
        mean: of each Gaussian.
        std: of each.
        truth: of the same shape.
        level: probability of the interval.

    Returns:
        The share.

    Raises:
        ValueError: for what is none of these.
    """
    middle, spread, true = _gaussians(mean, std, truth)
    # Not the quantile itself, which is infinite at 1, and nothing times that is NaN.
    inside = np.abs(true - middle) <= min(ndtri(0.5 + 0.5 * validate.number("level", level, 0.0, 1.0)), 1e9) * spread
    return float(inside.mean()) if inside.size else float("nan")


def rank_counts(mean: ArrayLike, std: ArrayLike, truth: ArrayLike, bins: int = 40) -> NDArray[np.int64]:
    """Count in which of equally probable parts of a Gaussian the truth lies.

    Flat where a belief is honest, heaped at the ends where it is too sure (Talts et al. 2018, arXiv:1804.06788); what
    is exact and said to be falls into the middle.

    Args:
        mean: of each Gaussian.
        std: of each.
        truth: of the same shape.
        bins: how many parts.

    Returns:
        (bins,) counts.

    Raises:
        ValueError: for what is none of these.
    """
    middle, spread, true = _gaussians(mean, std, truth)
    error = true - middle
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ranks = ndtr(np.where(error == 0, 0.0, error / spread))
    return np.histogram(ranks, validate.integer("bins", bins, 1, MOST_BINS), (0.0, 1.0))[0]


# Map


def reliability(occupancy: Array, truth: NDArray[np.bool_], cells: NDArray[np.bool_], bins: int = 10) -> Reliability:
    """Hold a map against the truth.

    Args:
        occupancy: (X, Y, Z) probabilities.
        truth: (X, Y, Z) whether each voxel is occupied.
        cells: (X, Y, Z) which voxels are asked.
        bins: B, of equal width.

    Returns:
        The calibration; NaN in an empty bin.

    Raises:
        ValueError: for what is none of these.
    """
    told = validate.probabilities("occupancy", occupancy)
    true, asked = validate.binary("truth", truth, told.shape), validate.binary("cells", cells, told.shape)
    validate.integer("bins", bins, 1, MOST_BINS)
    p, occupied = told[asked], true[asked].astype(np.float64)
    which = np.minimum((p * bins).astype(np.int64), bins - 1)
    count = np.bincount(which, minlength=bins)
    if p.size == 0:
        empty = np.full(bins, np.nan)
        return Reliability(empty, empty.copy(), count, *[float("nan")] * 3)
    with np.errstate(invalid="ignore"):
        predicted = np.bincount(which, p, bins) / count
        observed = np.bincount(which, occupied, bins) / count
    ece = float(np.nansum(np.abs(predicted - observed) * count) / p.size)
    log_loss = -np.log(np.maximum(np.where(true[asked], p, 1.0 - p), IMPOSSIBLE)).mean()
    return Reliability(predicted, observed, count, ece, float(np.square(p - occupied).mean()), float(log_loss))


# Name


def accuracy(correct: ArrayLike, level: float = 0.95) -> Share:
    """Tell a share with its Wilson interval.

    Args:
        correct: (n,) of each trial; entries may be shares themselves (of several draws of the exemplars): the interval
            is then that of as many trials, which is wide rather than narrow.
        level: probability of the interval.

    Returns:
        The share.

    Raises:
        ValueError: for what is none of these.
    """
    values = validate.probabilities("correct", correct, 1)
    validate.number("level", level, 0.0, 1.0)
    if values.size == 0:
        return Share(float("nan"), 0.0, 1.0, 0)
    from scipy.stats import binomtest  # which takes a second to import, and is not asked for in a trial

    test = binomtest(round(values.sum()), values.size)
    interval = test.proportion_ci(level, method="wilson")
    return Share(float(values.mean()), float(interval.low), float(interval.high), values.size)


def time_to_decision(seconds: ArrayLike, posterior: ArrayLike, threshold: float = 0.95) -> float:
    """Find from when on the label that ends most probable stays above a threshold.

    Args:
        seconds: (T,).
        posterior: (T, C).
        threshold: probability.

    Returns:
        The first of `seconds`; NaN where the decision is not made by the end.

    Raises:
        ValueError: for what is none of these.
    """
    chain = validate.probabilities("posterior", posterior, 2)
    stamps = validate.numbers("seconds", seconds, 1, bound=LATEST)
    if len(stamps) != len(chain):
        raise ValueError(f"posterior must be of shape ({len(stamps)}, C), as long as seconds, got {chain.shape}")
    if chain.size == 0:
        return float("nan")
    sure = chain[:, int(np.argmax(chain[-1]))] > validate.number("threshold", threshold, 0.0, 1.0)
    doubts = np.flatnonzero(~sure)
    first = doubts[-1] + 1 if doubts.size else 0
    return float(stamps[first]) if first < len(chain) else float("nan")


def closure(slam: float, floor: float, ceiling: float) -> float:
    """Tell how much of the way from floor to ceiling is gone, (slam - floor) / (ceiling - floor).

    Args:
        slam: any measure.
        floor: the same of the floor.
        ceiling: the same of the ceiling.

    Returns:
        0 at the floor, 1 at the ceiling; NaN where the two are the same, or where any of the three could not be said.

    Raises:
        ValueError: for what is none of these.
    """
    ends = {"slam": slam, "floor": floor, "ceiling": ceiling}
    one, low, high = (
        each if isinstance(each, float) and math.isnan(each) else validate.number(what, each, -1e300, 1e300)
        for what, each in ends.items()
    )
    gap = high - low
    return (one - low) / gap if gap != 0 else float("nan")


def _gaussians(mean: ArrayLike, std: ArrayLike, truth: ArrayLike) -> list[Array]:
    found = validate.together(mean=mean, std=std, truth=truth)
    if (found[1] < 0).any():
        raise ValueError(f"std must not be negative, got {found[1].min():g}")
    return found
