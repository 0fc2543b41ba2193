"""How good a belief is. Metrics may read the truth; observers never do.

Shapes: T steps, J joints, P patches, C labels, B bins, M places, (X, Y, Z) voxels. Angles in radians, lengths in
metres. What cannot be said (a share of nothing) is NaN. What is given must be finite, real, of these shapes and, where
it is a probability, in [0, 1]: else all raise `ValueError`, which quotes it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from scipy.special import ndtr, ndtri

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from haptic_env.shapes.base import Solid
from observer import edge
from observer.kinematics import placed_points
from observer.swept_volume import LEAST_SPACING, posed
from observer.swept_volume import neighbourhood as neighbourhood
from observer.swept_volume import swept as swept

OCCUPIED = 0.5
IMPOSSIBLE = 1e-6  # probability below which the log loss takes all for the same
LATEST = 1e10  # seconds: a clock that counts from 1970
MOST_BINS = 100_000
WIDEST = 1e9  # rad: an angle that has been added up for years
FAR = 1e6  # metres
TOUCH_TOLERANCE = 0.002  # metres: skin further from the surface than this rang falsely


class SurfaceScore(NamedTuple):
    """Shares in [0, 1]; `f_score` is the harmonic mean of `precision` and `recall`."""

    precision: float
    recall: float
    f_score: float


class Reliability(NamedTuple):
    """For each bin of predicted probability (B,): their mean, how often it was true, and how many cells; then the
    expected calibration error (mean gap between the two, weighted by cells), and over all cells the Brier score and
    the `log_loss` (nats), of a truth held for impossible that of one in a million."""

    predicted: Array
    observed: Array
    cells: NDArray[np.int64]
    ece: float
    brier: float
    log_loss: float


class Share(NamedTuple):
    """A share of trials with its interval."""

    mean: float
    low: float
    high: float
    trials: int


# Pose


def pose_error_deg(estimate: ArrayLike, truth: ArrayLike) -> Array:
    """(T,) degrees: RMS over joints of `estimate` (T, J) rad about `truth` (T, J) rad, at each step."""
    one, other = validate.together(WIDEST, estimate=estimate, truth=truth)
    if one.ndim == 0 or one.shape[-1] == 0:
        raise ValueError(f"estimate and truth must be angles of some joints (T, J), got shape {one.shape}")
    return np.rad2deg(np.sqrt(np.square(one - other).mean(axis=-1)))


def pose_rmse_deg(estimate: ArrayLike, truth: ArrayLike) -> float:
    """Degrees: RMS over steps and joints."""
    error = pose_error_deg(estimate, truth)
    return float(np.sqrt(np.square(error).mean())) if error.size else float("nan")


def credible_coverage(mean: ArrayLike, std: ArrayLike, truth: ArrayLike, level: float = 0.9) -> float:
    """How often the central interval of probability `level` of a Gaussian of `mean` and `std` holds `truth`."""
    middle, spread, true = _gaussians(mean, std, truth)
    # Not the quantile itself, which is infinite at 1, and nothing times that is NaN.
    inside = np.abs(true - middle) <= min(ndtri(0.5 + 0.5 * validate.number("level", level, 0.0, 1.0)), 1e9) * spread
    return float(inside.mean()) if inside.size else float("nan")


def rank_counts(mean: ArrayLike, std: ArrayLike, truth: ArrayLike, bins: int = 40) -> NDArray[np.int64]:
    """(bins,): how often `truth` falls into each of `bins` equally probable parts of a Gaussian of `mean` and `std`.

    Flat where a belief is honest, heaped at the ends where it is too sure (Talts et al. 2018, arXiv:1804.06788); what
    is exact and said to be falls into the middle.
    """
    middle, spread, true = _gaussians(mean, std, truth)
    error = true - middle
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ranks = ndtr(np.where(error == 0, 0.0, error / spread))
    return np.histogram(ranks, validate.integer("bins", bins, 1, MOST_BINS), (0.0, 1.0))[0]


# Map


def touched_places(
    hand: Hand,
    joint_angles: ArrayLike,
    contacts: ArrayLike,
    solid: Solid,
    spacing: float = 0.002,
    roots: Sequence[Pose] | None = None,
) -> Array:
    """(M, 3) m: where the skin really touched `solid`, one place per cube of edge `spacing` (m).

    At each step, with the true `joint_angles` (T, J), it is the point of every patch that rang (`contacts` (T, P))
    nearest to the surface; a patch whose skin is further than `TOUCH_TOLERANCE` away rang falsely and is left out.
    `roots` (T): where the hand as a whole was in the frame of `solid`, if it moved.
    """
    edge.world(hand=hand, solid=solid)
    skin = hand.patches.surface(validate.number("spacing", spacing, LEAST_SPACING, 1.0, unit="m"))
    found, steps = [], list(posed(hand, joint_angles, roots))
    for (tree, angles), rang in zip(
        steps, validate.binary("contacts", contacts, (len(steps), len(hand.patches))), strict=True
    ):
        if not rang.any():
            continue
        mine = np.flatnonzero(rang[skin.patch])
        points = placed_points(tree, angles, skin.points[mine], skin.link[mine])
        gap = np.abs(solid.signed_distance(points))
        order = np.lexsort((gap, skin.patch[mine]))  # patch by patch, the nearest point first
        nearest = order[np.unique(skin.patch[mine][order], return_index=True)[1]]
        found.append(points[nearest[gap[nearest] <= TOUCH_TOLERANCE]])
    places = np.concatenate(found) if found else np.empty((0, 3))
    cubes = np.floor(places / spacing).astype(np.int64)
    return places[np.sort(np.unique(cubes, axis=0, return_index=True)[1])]


def surface_precision(occupancy: Array, grid: Grid, solid: Solid, voxels: float = 1.0) -> float:
    """Share of the occupied voxels whose centre lies within `voxels` of the true surface; 0 where none is occupied."""
    edge.world(grid=grid, solid=solid)
    centres = grid.centres()[_map(occupancy, grid) > OCCUPIED]
    near = np.abs(solid.signed_distance(centres)) <= _length(voxels, grid)
    return float(near.mean()) if near.size else 0.0


def surface_recall(occupancy: Array, grid: Grid, places: Array, voxels: float = 1.0) -> float:
    """Share of `places` (M, 3) m with the centre of an occupied voxel within `voxels`; NaN without a place."""
    edge.world(grid=grid)
    where = _places("places", places)
    occupied, near = _map(occupancy, grid) > OCCUPIED, _length(voxels, grid)
    if len(where) == 0:
        return float("nan")
    if not occupied.any():
        return 0.0
    distance, _ = cKDTree(grid.centres()[occupied]).query(where)
    return float((distance <= near).mean())


def surface_score(occupancy: Array, grid: Grid, solid: Solid, touched: Array, voxels: float = 1.0) -> SurfaceScore:
    """Precision of the occupied voxels against the true surface, recall of the `touched` (M, 3) places, F-score."""
    precision = surface_precision(occupancy, grid, solid, voxels)
    recall = surface_recall(occupancy, grid, _places("touched", touched), voxels)
    total = precision + recall
    return SurfaceScore(precision, recall, 2 * precision * recall / total if total != 0 else 0.0)


def surface_coverage(occupancy: Array, grid: Grid, solid: Solid, voxels: float = 1.0) -> float:
    """Share of the whole true surface (voxels that it passes through) with an occupied voxel within `voxels`."""
    return surface_recall(occupancy, grid, surface_places(solid, grid), voxels)


def surface_places(solid: Solid, grid: Grid) -> Array:
    """(M, 3) m: the centres of the voxels that the surface of `solid` passes through."""
    edge.world(grid=grid, solid=solid)
    centres = grid.centres()
    return centres[np.abs(solid.signed_distance(centres)) <= _length(0.5, grid)]


def reachable(
    hand: Hand, joint_angles: ArrayLike, grid: Grid, roots: Sequence[Pose] | None = None
) -> NDArray[np.bool_]:
    """(X, Y, Z): the voxels that the hand swept (`swept`), and their 26 neighbours: the skin could have felt what is
    there."""
    return neighbourhood(swept(hand, joint_angles, grid, roots))


def reached_into(solid: Solid, grid: Grid) -> NDArray[np.bool_]:
    """(X, Y, Z): the voxels whose centre lies inside `solid` or within half a voxel of its surface."""
    edge.world(grid=grid, solid=solid)
    return np.asarray(solid.signed_distance(grid.centres()) <= _length(0.5, grid))


def reliability(occupancy: Array, truth: NDArray[np.bool_], cells: NDArray[np.bool_], bins: int = 10) -> Reliability:
    """Calibration of `occupancy` (X, Y, Z) against `truth` (X, Y, Z), over `cells` (X, Y, Z) alone.

    Bins are of equal width; `predicted` and `observed` are NaN in an empty one.
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
    """Share of `correct` (n,) with its Wilson interval. Entries may be shares themselves (of several draws of the
    exemplars): the interval is then that of as many trials, which is wide rather than narrow."""
    values = validate.probabilities("correct", correct, 1)
    validate.number("level", level, 0.0, 1.0)
    if values.size == 0:
        return Share(float("nan"), 0.0, 1.0, 0)
    from scipy.stats import binomtest  # which takes a second to import, and is not asked for in a trial

    test = binomtest(round(values.sum()), values.size)
    interval = test.proportion_ci(level, method="wilson")
    return Share(float(values.mean()), float(interval.low), float(interval.high), values.size)


def time_to_decision(seconds: ArrayLike, posterior: ArrayLike, threshold: float = 0.95) -> float:
    """The first of `seconds` (T,) from which on the label that ends most probable stays above `threshold`.

    `posterior` (T, C). NaN where the decision is not made by the end.
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
    """(slam - floor) / (ceiling - floor): 0 at the floor, 1 at the ceiling; NaN where the two are the same, or where
    any of the three could not be said."""
    ends = {"slam": slam, "floor": floor, "ceiling": ceiling}
    one, low, high = (
        each if isinstance(each, float) and math.isnan(each) else validate.number(what, each, -1e300, 1e300)
        for what, each in ends.items()
    )
    gap = high - low
    return (one - low) / gap if gap != 0 else float("nan")


def _length(voxels: float, grid: Grid) -> float:
    """Metres; a hair more, so that rounding does not decide about what is exactly so far away (neighbours are)."""
    return validate.number("voxels", voxels, 0.0, 1e6) * grid.resolution * (1 + 1e-6)


def _places(what: str, value: ArrayLike) -> Array:
    places = validate.numbers(what, value, 2, bound=FAR)
    if places.shape[1] != 3:
        raise ValueError(f"{what} must be of shape (M, 3) in m, got shape {places.shape}")
    return places


def _map(occupancy: ArrayLike, grid: Grid) -> Array:
    result = validate.probabilities("occupancy", occupancy, 3)
    if result.shape != grid.shape:
        raise ValueError(f"occupancy must be of the grid's shape {grid.shape}, got {result.shape}")
    return result


def _gaussians(mean: ArrayLike, std: ArrayLike, truth: ArrayLike) -> list[Array]:
    found = validate.together(mean=mean, std=std, truth=truth)
    if (found[1] < 0).any():
        raise ValueError(f"std must not be negative, got {found[1].min():g}")
    return found
