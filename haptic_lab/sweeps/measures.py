"""The measures of a trial: pose error, credible coverage, surface and occupancy scores and the
time to decision.

Shapes: T steps, J joints, C labels, (X, Y, Z) voxels, M touched places, S places of the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.grid import Grid
from haptic_env.shapes.names import NONE
from haptic_lab.records import BeliefTrace, Exploration
from observer import metrics

AFTER_SECONDS = (2, 5, 10)  # when the name is asked for
FIRST_SECONDS = 5  # over which how soon it is right is averaged
MEASURES = (
    "pose_error_online_deg",
    "pose_error_lagged_deg",
    "pose_error_touching_deg",
    "coverage_90",
    "coverage_90_lagged",
    *(f"surface_{what}_{n}" for n in (1, 2) for what in ("precision", "recall", "f_score")),
    "surface_coverage",
    "growing_f_score_1",
    "growing_brier",
    "occupancy_ece",
    "occupancy_brier",
    "skin_ece",
    "skin_brier",
    "skin_log_loss",
    "touching_share",
    "n_eff",
    "time_to_decision",
    "step_accuracy",
    f"step_accuracy_{FIRST_SECONDS}s",
    *(f"correct_{seconds}s" for seconds in AFTER_SECONDS),
)
OF_MAPS = tuple(name for name in MEASURES if name.startswith(("surface_", "occupancy_")))
RANKS = ("ranks_online", "ranks_lagged")
CELLS, OF_CELLS = ("cells", "cells_predicted", "cells_observed"), ("cells", "predicted", "observed")
SKIN_CELLS = tuple(f"skin_{name}" for name in CELLS)  # of voxels beside the skin, which a map can know
HISTOGRAMS = (*RANKS, *CELLS, *SKIN_CELLS)  # numbers with spaces
COURSES = ("course_p", "course_correct")  # likewise: the shape posterior of the truth, and whether it is the largest
COURSE_SECONDS = 0.25  # from one of these to the next


class GroundTruth(NamedTuple):
    """What is true of the world of an exploration.

    Attributes:
        touching: (T,) steps at which the hand was.
        touched: (M, 3) m, places that it touched.
        cells: (X, Y, Z) which voxels it could reach.
        occupied: (X, Y, Z) in which the object had the centre.
        beside: (X, Y, Z) those that the skin swept, or that share a face with one.
        reached: (X, Y, Z) into which the object reached.
        surface: (S, 3) m, places of the whole surface.
    """

    touching: NDArray[np.bool_]
    touched: NDArray[np.float64]
    cells: NDArray[np.bool_]
    occupied: NDArray[np.bool_]
    beside: NDArray[np.bool_]
    reached: NDArray[np.bool_]
    surface: NDArray[np.float64]

    @classmethod
    def of(cls, exploration: Exploration, grid: Grid) -> GroundTruth:
        """Work out what is true.

        Args:
            exploration: what happened.
            grid: of the voxels.

        Returns:
            The truth.
        """
        hand, truth, contacts, solid, roots = (
            exploration.hand,
            exploration.true_angles,
            exploration.contacts,
            exploration.solid,
            exploration.roots,
        )
        swept = metrics.swept(hand, truth, grid, roots)
        return cls(
            np.asarray(contacts.any(axis=1)),
            metrics.touched_places(hand, truth, contacts, solid, roots=roots),
            metrics.neighbourhood(swept),
            solid.occupancy(grid),
            metrics.neighbourhood(swept, faces=True),
            metrics.reached_into(solid, grid),
            metrics.surface_places(solid, grid),
        )


def measures_of(exploration: Exploration, ground_truth: GroundTruth, trace: BeliefTrace) -> dict[str, Any]:
    """Judge an observer.

    Args:
        exploration: what happened.
        ground_truth: of it.
        trace: what the observer believed.

    Returns:
        The columns of a row that have nothing to do with how it was asked for.
    """
    _, touched, cells, occupied, beside, reached, surface = ground_truth
    grid, solid = trace.belief.grid, exploration.solid
    occupancy = trace.belief.occupancy
    calibration = metrics.reliability(occupancy, occupied, cells)
    beside_skin = metrics.reliability(occupancy, reached, beside)
    row = measures_without_map(exploration, trace) | {
        "surface_coverage": metrics.surface_recall(occupancy, grid, surface),
        "occupancy_ece": calibration.ece,
        "occupancy_brier": calibration.brier,
        **{f"skin_{what}": getattr(beside_skin, what) for what in ("ece", "brier", "log_loss")},
        "growing_f_score_1": metrics.surface_score(trace.growing, grid, solid, touched).f_score,
        "growing_brier": metrics.reliability(trace.growing, reached, beside).brier,
        **_histogram(CELLS, calibration),
        **_histogram(SKIN_CELLS, beside_skin),
    }
    for n in (1, 2):
        score = metrics.surface_score(occupancy, grid, solid, touched, n)
        row |= {f"surface_{what}_{n}": value for what, value in score._asdict().items()}
    return row


def measures_without_map(exploration: Exploration, trace: BeliefTrace) -> dict[str, Any]:
    """Judge where an observer took the hand to be, and what it called the object.

    Args:
        exploration: what happened.
        trace: what the observer believed.

    Returns:
        As `measures_of`; of the map there is nothing.
    """
    truth, touching = exploration.true_angles, np.asarray(exploration.contacts.any(axis=1))
    right = trace.posterior.argmax(axis=1) == _of_truth(trace, exploration.solid.name)
    row: dict[str, Any] = {
        **dict.fromkeys(MEASURES, float("nan")),
        **dict.fromkeys(HISTOGRAMS, ""),
        "pose_error_online_deg": metrics.pose_rmse_deg(trace.joint_angles, truth),
        "pose_error_lagged_deg": metrics.pose_rmse_deg(trace.lagged_joint_angles, truth),
        "pose_error_touching_deg": metrics.pose_rmse_deg(trace.lagged_joint_angles[touching], truth[touching]),
        "coverage_90": metrics.credible_coverage(trace.joint_angles, trace.joint_std, truth),
        "coverage_90_lagged": metrics.credible_coverage(trace.lagged_joint_angles, trace.lagged_joint_std, truth),
        "touching_share": float(touching.mean()),
        "n_eff": float(trace.n_eff.mean()),
        "time_to_decision": metrics.time_to_decision(exploration.seconds, trace.posterior),
        "step_accuracy": float(right.mean()),
        f"step_accuracy_{FIRST_SECONDS}s": float(right[exploration.seconds <= FIRST_SECONDS + 1e-9].mean()),
    }
    ranks = (
        metrics.rank_counts(trace.joint_angles, trace.joint_std, truth),
        metrics.rank_counts(trace.lagged_joint_angles, trace.lagged_joint_std, truth),
    )
    row |= {what: _spaced(numbers) for what, numbers in zip(RANKS, ranks, strict=True)}
    row |= {what: _spaced(numbers) for what, numbers in zip(COURSES, course(exploration, trace), strict=True)}
    row |= {f"correct_{after}s": correct_after(exploration, trace, after) for after in AFTER_SECONDS}
    return row | {f"p_{label}": float(p) for label, p in zip(trace.labels, trace.posterior[-1], strict=True)}


def _histogram(names: Sequence[str], found: metrics.Reliability) -> dict[str, str]:
    return {name: _spaced(getattr(found, part)) for name, part in zip(names, OF_CELLS, strict=True)}


def _spaced(numbers: np.ndarray) -> str:
    return " ".join(f"{each:.6g}" for each in numbers)


def correct_after(exploration: Exploration, trace: BeliefTrace, seconds: float) -> float:
    """Judge the shape posterior at one time.

    Args:
        exploration: what happened.
        trace: what the observer believed.
        seconds: of the exploration.

    Returns:
        1 where it found the true shape the most probable, else 0; NaN where the exploration is shorter.
    """
    steps = int(np.searchsorted(exploration.seconds, seconds - 1e-9))
    if steps == len(exploration.seconds):
        return float("nan")
    return float(np.argmax(trace.posterior[steps]) == _of_truth(trace, exploration.solid.name))


def course(exploration: Exploration, trace: BeliefTrace) -> tuple[np.ndarray, np.ndarray]:
    """Judge the shape posterior after each `COURSE_SECONDS`.

    Args:
        exploration: what happened.
        trace: what the observer believed.

    Returns:
        The probability of the true shape, and 1 where no other is more probable, else 0.
    """
    times = np.arange(COURSE_SECONDS, exploration.seconds[-1] + 1e-9, COURSE_SECONDS)
    posterior = trace.posterior[np.searchsorted(exploration.seconds, times - 1e-9)]
    truth = _of_truth(trace, exploration.solid.name)
    probability = posterior[:, truth] if truth >= 0 else np.zeros(len(times))
    return probability, (posterior.argmax(axis=1) == truth).astype(float)


def _of_truth(trace: BeliefTrace, name: str) -> int:
    """Which label is right for an object: "none" where it is none of the candidates; -1 where none is."""
    right = name if name in trace.labels else NONE
    return trace.labels.index(right) if right in trace.labels else -1
