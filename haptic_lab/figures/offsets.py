"""What errors of felt angles that last do: pose, intervals, map and name against bias and drift, for the observer that
finds offsets out and for the one that takes all noise for white."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from haptic_env import validate
from haptic_lab.analysis.statistics import told_of_trials
from haptic_lab.analysis.summary import ALL, CEILING, FLOOR, SLAM, errors_of, summarise
from haptic_lab.conditions import Condition
from haptic_lab.figures.paper_figure import WIDTH, PaperFigure
from haptic_lab.style import OBSERVER_COLOURS, OBSERVER_NAMES
from haptic_lab.sweeps.tasks import STREAM

WHITE = "white"
OBSERVERS = (FLOOR, WHITE, SLAM, CEILING)
SIGMAS, AMOUNTS = (1.0, 3.0), (0.0, 1.0, 3.0, 5.0)  # degrees
KINDS = {"bias_deg": "constant offset, SD (°)", "drift_deg": "drift, SD (°)"}
MEASURES = {
    "pose_error_lagged_deg": ("Pose error after 200 ms", "RMS error (°)", 1.0),
    "coverage_90_lagged": ("90 % intervals", "hold the truth (%)", 100.0),
    "surface_f_score_1": ("Map", "F-score at one voxel", 1.0),
    f"{STREAM}_correct": ("Name", "named right (%)", 100.0),
}
OF_POSE = list(MEASURES)[:2]  # the ceiling is told the true pose
DASHES: Any = ("-", (0, (4, 1.5)), ":", "-.")
SPREAD = 0.06  # degrees: between curves, so that their intervals can be told apart


def conditions(usual: Condition, sigmas: Iterable[float], amounts: Iterable[float]) -> tuple[Condition, ...]:
    """List what is explored.

    Args:
        usual: all else of each condition.
        sigmas: degrees.
        amounts: degrees, of bias and of drift, each by itself.

    Returns:
        The conditions, each once.

    Raises:
        ValueError: for an amount out of range.
    """
    none: dict[str, Any] = dict.fromkeys(KINDS, 0.0)
    told = [(sigma, kind, amount) for sigma in sigmas for amount in amounts for kind in KINDS]
    some = [none | {"sigma_deg": sigma, kind: amount} for sigma, kind, amount in told]
    return tuple(dict.fromkeys(replace(usual, **each) for each in some))


def draw(rows: pd.DataFrame) -> PaperFigure:
    """Draw what bias and drift do.

    Args:
        rows: of the table of trials, in which nothing but sigma, bias and drift varies.

    Returns:
        Above against the bias, below against the drift, a panel for each of `MEASURES`; full lines are of the least
        sigma, dashed ones of larger ones.

    Raises:
        ValueError: for trials without bias and without drift.
    """
    data = _table(rows)
    sigmas = sorted(set(data["sigma_deg"]))
    observers = [name for name in OBSERVERS if name in set(data["observer"])]
    figure = Figure(figsize=(WIDTH, 4.3), layout="constrained")
    kinds = [kind for kind in KINDS if kind in set(data["kind"])]
    panels = figure.subplots(len(kinds), len(MEASURES), sharex=True, sharey="col", squeeze=False)
    for axes, (title, _, _) in zip(panels[0], MEASURES.values(), strict=True):
        axes.set_title(title)
    for row, kind in zip(panels, kinds, strict=True):
        for axes, (measure, (_, axis, unit)) in zip(row, MEASURES.items(), strict=True):
            mine = data[(data["kind"] == kind) & (data["measure"] == measure)]
            _panel(axes, mine, measure, observers, sigmas, unit)
            axes.set(xlabel=KINDS[kind], ylabel=axis)
    # Axes are shared, and to set a limit keeps them from growing with what is drawn after it.
    for axes, highest in zip(panels[0], (None, 103, 1, 103), strict=True):
        axes.set_ylim(0, highest)
    panels[0, 0].set_xticks(sorted(set(data["amount"])))
    seconds, drift = rows["seconds"].iloc[0], rows["drift_seconds"].iloc[0]
    handles = [Line2D([], [], color=OBSERVER_COLOURS[name], label=OBSERVER_NAMES[name]) for name in reversed(observers)]
    handles += [
        Line2D([], [], color="#555555", linestyle=DASHES[nth % len(DASHES)], label=f"σ = {sigma:g}°")
        for nth, sigma in enumerate(sigmas)
    ]
    trials = int(data["trials"].max())
    told = f"{validate.counted(trials, 'exploration')} of {seconds:g} s for each noise, {told_of_trials(trials)}"
    told += f"; drift with a time constant of {drift:g} s" if "drift_deg" in kinds else ""
    tight: Any = {"columnspacing": 1.1, "handlelength": 1.6, "handletextpad": 0.5}
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), title=told, fontsize=7.5, **tight)
    return PaperFigure(figure, data)


def _table(rows: pd.DataFrame) -> pd.DataFrame:
    """A line for each kind of error, its amount, σ, observer and measure."""
    measures = [name for name in MEASURES if not name.startswith(STREAM)]
    lines = summarise(rows, measures, (STREAM,))
    lines = lines[lines["shape"] == ALL]
    found = []
    for kind in KINDS:
        (other,) = set(KINDS) - {kind}
        mine = lines[lines[other] == 0]
        if mine[kind].nunique() > 1:
            found.append(mine.assign(kind=kind, amount=mine[kind]))
    if not found:
        raise ValueError(f"the figure offsets is of trials with several of {' or '.join(KINDS)}, and these have one")
    names = ["kind", "amount", "sigma_deg", "observer", "measure", "mean", "low", "high", "trials"]
    return pd.concat(found)[names]


def _panel(
    axes: Axes, lines: pd.DataFrame, measure: str, observers: Sequence[str], sigmas: Sequence[float], unit: float
) -> None:
    """Every observer and σ; the ceiling, which feels no noise, once."""
    count = len(observers) * len(sigmas)
    for nth, observer in enumerate(observers):
        if observer == CEILING and measure in OF_POSE:
            continue
        for which, sigma in enumerate(sigmas[:1] if observer == CEILING else sigmas):
            line = lines[(lines["observer"] == observer) & (lines["sigma_deg"] == sigma)].sort_values("amount")
            axes.errorbar(
                line["amount"] + SPREAD * (nth * len(sigmas) + which - 0.5 * (count - 1)),
                unit * line["mean"],
                unit * errors_of(line),
                color=OBSERVER_COLOURS[observer],
                linestyle=DASHES[which % len(DASHES)],
                linewidth=2.0 if observer == SLAM else 1.2,
                elinewidth=0.7,
                marker="o",
                markersize=2.5,
            )
    if measure == "coverage_90_lagged":
        axes.axhline(90.0, color="#777777", linewidth=0.8, linestyle=":")
