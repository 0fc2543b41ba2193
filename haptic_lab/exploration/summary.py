"""The results of one exploration as a dict for JSON (posterior, pose error, surface scores), and as a table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from haptic_lab import replay
from haptic_lab.exploration import senses
from haptic_lab.exploration.settings import OBSERVER, RAW, ExplorationSettings
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.style import colours_of, titles_of, with_article
from observer import metrics

WITHIN = ((1, "1 voxel"), (2, "2 voxels"))


def summarise(
    settings: ExplorationSettings,
    exploration: Exploration,
    traces: dict[str, BeliefTrace],
    truth: str,
    took: float,
    simulated: bool = False,
) -> dict[str, Any]:
    """Work out the figures of one exploration, for people (`table`) and machines (explore.json) alike.

    Args:
        settings: of the exploration.
        exploration: what happened.
        traces: of the observers, by name.
        truth: the name of the object.
        took: seconds of computing.
        simulated: whether the object is not the recording's own, so that its name is nobody's truth.

    Returns:
        What JSON can say, but for NaN.
    """
    slam, solid, roots = traces[OBSERVER], exploration.solid, exploration.roots
    belief = slam.belief
    touched = metrics.touched_places(
        exploration.hand, exploration.true_angles, exploration.contacts, solid, roots=roots
    )

    def surface(name: str, voxels: float) -> dict[str, float]:
        score = metrics.surface_score(traces[name].belief.occupancy, belief.grid, solid, touched, voxels)
        return score._asdict()

    def pose(angles: np.ndarray) -> dict[str, float]:
        error = metrics.pose_rmse_deg(angles, exploration.true_angles)
        return {"degrees": error, "sigmas": error / settings.sigma if settings.sigma > 0 else math.nan}

    cells = metrics.reachable(exploration.hand, exploration.true_angles, belief.grid, roots)
    calibration = metrics.reliability(belief.occupancy, solid.occupancy(belief.grid), cells)
    about = {
        **(replay.SIMULATED if simulated or roots is not None else {}),
        **({"simulated_object": truth} if simulated else {}),
    }
    return {
        **shared_figures(settings, exploration, slam, took, None if simulated else truth, about),
        "pose_error": {
            "raw angles": pose(exploration.felt_angles),
            "haptic SLAM, online": pose(slam.joint_angles),
            "haptic SLAM, lagged": pose(slam.lagged_joint_angles),
        },
        "coverage_90": metrics.credible_coverage(slam.joint_angles, slam.joint_std, exploration.true_angles),
        **senses.found(settings, exploration, slam),
        "surface": {label: {"raw angles": surface(RAW, n), "haptic SLAM": surface(OBSERVER, n)} for n, label in WITHIN},
        "surface_coverage": metrics.surface_coverage(belief.occupancy, belief.grid, solid),
        "occupancy_ece": calibration.ece,
        "occupancy_brier": calibration.brier,
    }


def shared_figures(
    settings: ExplorationSettings,
    exploration: Exploration,
    slam: BeliefTrace,
    took: float,
    truth: str | None,
    about: Mapping[str, Any],
) -> dict[str, Any]:
    """Work out the figures that any exploration has: what was named, how surely, whether rightly, and when.

    Args:
        settings: of the exploration.
        exploration: what happened.
        slam: what the observer believed.
        took: seconds of computing.
        truth: the name of the object; None: nobody tells.
        about: what else is told of the touch.

    Returns:
        What JSON can say, but for NaN.
    """
    return {
        "settings": {name: each for name, each in asdict(settings).items() if name != "view"},
        "explored_seconds": float(exploration.seconds[-1]),
        "computing_seconds": took,
        "named": slam.name,
        "truth": truth,
        "correct": None if truth is None else slam.name == truth,
        **about,
        "posterior": dict(zip(slam.labels, map(float, slam.posterior[-1]), strict=True)),
        "time_to_decision": metrics.time_to_decision(exploration.seconds, slam.posterior),
        "touching_share": float(exploration.contacts.any(axis=1).mean()),
    }


def table(summary: dict[str, Any]) -> Table:
    """Lay out the figures of one exploration.

    Args:
        summary: what `summarise` returns.

    Returns:
        The table as a person reads it.
    """
    truth, simulated = object_of(summary)
    there = "contacts are simulated with" if simulated else "in truth it is"
    result = opening(summary, touch_of(summary), there, truth)
    for name, error in summary["pose_error"].items():
        sigmas = "" if math.isnan(error["sigmas"]) else f" = {error['sigmas']:.2f} σ"
        result.add_row(f"pose error, {name}", f"{error['degrees']:.2f}°{sigmas}")
    result.add_row("90 % interval holds the truth", f"{summary['coverage_90']:.0%} of the time")
    result.add_section()
    for name in ("raw angles", "haptic SLAM"):
        scores = {n: each[name]["f_score"] for n, each in summary["surface"].items()}
        told = ", ".join(f"{score:.2f} ({n})" for n, score in scores.items() if not math.isnan(score))
        result.add_row(f"surface F-score, {name}", told or "it touched nothing")
    result.add_row("of the whole surface mapped", f"{summary['surface_coverage']:.0%}")
    result.add_row("fingers touched it", f"{summary['touching_share']:.0%} of the time")
    result.add_row("computing took", f"{summary['computing_seconds']:.1f} s")
    return result


def opening(summary: Mapping[str, Any], touch: str, there: str, truth: str | None) -> Table:
    """Begin the table of an exploration: what was named, how surely, whether rightly, and when.

    Args:
        summary: with `named`, `posterior`, `explored_seconds` and `time_to_decision`.
        touch: what kind it was.
        there: says of what follows who tells it.
        truth: what is really there; None: nobody tells.

    Returns:
        The table, to which further sections are added.
    """
    named, labels = summary["named"], tuple(summary["posterior"])
    titles = titles_of(labels if truth is None else (*labels, truth))
    title = f"After {summary['explored_seconds']:g} s of {touch} touch"
    result = Table(show_header=False, title=title, title_justify="left")
    result.add_column(style="dim")
    result.add_column()
    result.add_row("the object is", Text(with_article(titles[named], named), style=f"bold {colours_of(labels)[named]}"))
    result.add_row("how sure", f"{summary['posterior'][named]:.1%}")
    if truth is not None:
        mark = ("right", "green") if named == truth else ("wrong", "red")
        result.add_row(there, Text.assemble(with_article(titles[truth], truth), " (", mark, ")"))
    when = summary["time_to_decision"]
    result.add_row("decided after", "not decided (95 %)" if math.isnan(when) else f"{when:.2f} s (95 % and stays)")
    result.add_section()
    return result


def touch_of(summary: dict[str, Any]) -> str:
    """Say what kind of touch an exploration is of.

    Args:
        summary: what `summarise` returns.

    Returns:
        "simulated" where a recording is followed whose touch was not measured, else "blind".
    """
    return "simulated" if replay.SIMULATED.items() <= summary.items() else "blind"


def object_of(summary: dict[str, Any]) -> tuple[str, bool]:
    """Find the object of an exploration.

    Args:
        summary: what `summarise` returns.

    Returns:
        Its name, and whether it is there in the simulation alone.
    """
    simulated = summary["truth"] is None
    return summary["simulated_object" if simulated else "truth"], simulated
