"""What the table of a sweep says: means with 95 % intervals, the brackets side by side, and a picture."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich import box
from rich.console import Console
from rich.table import Table

from haptic_env import validate
from haptic_lab.analysis.statistics import FEW, interval, told_of_trials
from haptic_lab.conditions import factors_in
from haptic_lab.faults import FAULTS, as_faults
from haptic_lab.files import atomic, part_of_name
from haptic_lab.style import OBSERVER_COLOURS, OBSERVER_NAMES, titles_of
from observer import metrics

ALL = "all"
NOT_MADE = "has none"  # of a bar that is not there: an observer without a map, say
FLOOR, SLAM, CEILING = "floor", "haptic_slam", "ceiling"
TITLES = {
    "pose_error_lagged_deg": "Pose error, lagged (degrees)",
    "pose_error_online_deg": "Pose error, online (degrees)",
    "coverage_90": "How often the 90 % interval holds the true angle",
    "surface_f_score_1": "Surface F-score at 1 voxel",
    "surface_f_score_2": "Surface F-score at 2 voxels",
    "occupancy_ece": "Occupancy, expected calibration error over reachable voxels",
    "shape_posterior_correct": "Named right by the shape posterior over the stream of beliefs",
    "new_correct": "Said rightly that it is one of the candidates, or that it is new",
    "new_auroc": "New told from known by the probability of none of these (area under the ROC curve)",
    "name_ece": "Calibration error of the name that is given",
    **{f"correct_{n}s": f"Named right by the shape posterior after {n} s" for n in (2, 5, 10)},
    "shape_likelihood_correct": "Named right by the shape likelihood of the last map",
    "overlap_nearest_neighbour_correct": "Named right by the one learnt map whose touched voxels overlap most",
    "squared_nearest_neighbour_correct": "Named right by the one learnt map with the nearest probabilities",
    "nearest_neighbour_correct": "Named right by the one learnt map with most voxels alike (p > 0.5, the paper's)",
}
NAMERS = {  # what names the object, in a few words
    "nearest_neighbour": "one learnt map,\nvoxels alike (paper's)",
    "overlap_nearest_neighbour": "one learnt map,\ntouched voxels alike",
    "shape_likelihood": "one learnt map,\nits likelihood",
    "shape_posterior": "known shapes,\nall that was felt",
}


def summarise(rows: pd.DataFrame, measures: Sequence[str], namers: Sequence[str]) -> pd.DataFrame:
    """Take means over trials. Names: Wilson's interval. Everything else: Student's t over trials.

    Args:
        rows: of the table of trials.
        measures: columns of it.
        namers: what names the object; of each the column NAMER_correct is summed up too.

    Returns:
        A line for each of the factors, shape (and `ALL`), observer and measure: `mean`, 95 % interval (`low`, `high`),
        number of `trials`.
    """
    correct = [f"{namer}_correct" for namer in namers]
    shares = {*correct, *(each for each in measures if "correct" in each)}
    lines = []
    groups = [*factors_in(rows.columns), "shape", "observer"]
    for names, group in pd.concat([rows, rows.assign(shape=ALL)]).groupby(groups, sort=False):
        for measure in (*measures, *correct):
            values = group[measure].dropna().to_numpy(dtype=np.float64)
            mean, low, high, count = metrics.accuracy(values) if measure in shares else interval(values)
            lines.append((*names, measure, mean, low, high, count))
    return pd.DataFrame(lines, columns=[*groups, "measure", "mean", "low", "high", "trials"])


def parts(rows: pd.DataFrame, together: Sequence[str] = ("sigma_deg",)) -> Iterator[tuple[str, pd.DataFrame]]:
    """Split a table by what varies in it.

    Args:
        rows: of the table of trials.
        together: factors that are not told apart.

    Yields:
        Name, like "seconds=5.0", and rows of each combination of the other factors that vary; all rows, named "", where
        none does.
    """
    varying = [name for name in factors_in(rows.columns) if name not in together and rows[name].nunique() > 1]
    if not varying:
        yield "", rows
        return
    for values, part in rows.groupby(varying, sort=False):
        # Where some faults are named, pandas takes all for text.
        told = {
            name: as_faults(value) if name in FAULTS else value for name, value in zip(varying, values, strict=True)
        }
        yield ",".join(f"{name}={part_of_name(value)}" for name, value in told.items()), part


def save_picture(summary: pd.DataFrame, namers: Sequence[str], chance: float, folder: Path) -> None:
    """Write evaluate.png.

    Args:
        summary: what `summarise` returns.
        namers: as `summarise`'s.
        chance: how often a guess is right, in [0, 1].
        folder: to write to.
    """
    figure = draw(summary, namers, chance)
    with atomic(folder / "evaluate.png") as place:
        figure.savefig(place)


def print_report(
    lines: pd.DataFrame, console: Console, names_first: bool = False, titles: Mapping[str, str] = TITLES
) -> None:
    """Print measures, a table each, the observers side by side.

    Args:
        lines: what `summarise` returns.
        console: to print to.
        names_first: whether what is named comes before poses and maps.
        titles: of the measures that are printed, in their order.
    """
    order = sorted(titles, key=lambda measure: "correct" not in measure) if names_first else titles
    for measure in order:
        mine = lines[lines["measure"] == measure]
        if len(mine) and mine["trials"].max() > 0:
            console.print(_table(mine, measure, titles[measure]))


def draw(summary: pd.DataFrame, namers: Sequence[str], chance: float) -> Figure:
    """Draw pose error against noise, and how often the object is named right, by each namer and observer.

    Args:
        summary: what `summarise` returns.
        namers: as `summarise`'s.
        chance: how often a guess is right, in [0, 1].

    Returns:
        A panel for the pose and one for each namer.
    """
    rows = 1 + len(namers) // 2
    figure = Figure(figsize=(10, 3.5 * rows), layout="constrained")
    panels = figure.subplots(rows, 2).ravel()
    for unused in panels[1 + len(namers) :]:
        unused.axis("off")
    overall = summary[summary["shape"] == ALL]
    pose = overall[overall["measure"] == "pose_error_lagged_deg"]
    if pose["sigma_deg"].nunique() > 1:
        draw_pose(panels[0], pose)
    else:  # one point on an axis that begins at 0 leaves it empty
        _draw_bars(panels[0], pose, "Pose error, lagged")
        panels[0].set(ylabel="RMS error (degrees)")
    for axes, namer in zip(panels[1:], namers, strict=False):
        measure = f"{namer}_correct"
        title = NAMERS.get(namer, namer.replace("_", " ")).replace("\n", " ")
        _draw_bars(axes, overall[overall["measure"] == measure], f"Named right: {title}")
        axes.axhline(chance, color="#777777", linestyle=":", linewidth=1)
        axes.set(ylabel="share named right", ylim=(0, 1.02))
    handles, labels = panels[1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    trials = int(overall["trials"].max())
    simulated = f"{trials} replays with simulated contacts"
    many = simulated if "recording" in summary else validate.counted(trials, "exploration")
    told = told_of_trials(trials)
    figure.suptitle(f"{many} for each noise, {told}; dotted: chance", fontsize=12, fontweight="bold")
    return figure


def _table(lines: pd.DataFrame, measure: str, title: str) -> Table:
    observers = list(dict.fromkeys(lines["observer"]))
    bracketed = {FLOOR, SLAM, CEILING} <= set(observers) and not measure.startswith("coverage")
    result = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    for name in ("σ", "shape", "trials", *observers, *(["closure"] if bracketed else [])):
        result.add_column(name, justify="left" if name == "shape" else "right")
    titles = titles_of(dict.fromkeys(lines["shape"]))
    for sigma, of_sigma in lines.groupby("sigma_deg"):
        for shape in dict.fromkeys(of_sigma["shape"]):
            cells = of_sigma[of_sigma["shape"] == shape].set_index("observer")
            told = [_cell(cells.loc[name], measure) for name in observers]
            if bracketed:
                ends = (float(cells.loc[name, "mean"]) for name in (SLAM, FLOOR, CEILING))
                closure = metrics.closure(*ends)
                told.append("–" if math.isnan(closure) else f"{closure:.0%}")
            style = "bold" if shape == ALL else None
            result.add_row(f"{sigma:g}°", titles[shape], str(int(cells["trials"].max())), *told, style=style)
        result.add_section()
    return result


def _cell(line: pd.Series, measure: str) -> str:
    if math.isnan(line["mean"]):
        return "–"
    if "correct" in measure:
        return f"{line['mean']:.0%} [{100 * line['low']:.0f}–{100 * line['high']:.0f}]"
    half = 0.5 * (line["high"] - line["low"])
    return f"{line['mean']:.2f}" if math.isnan(half) else f"{line['mean']:.2f} ±{half:.2f}"


def draw_curve(axes: Axes, line: pd.DataFrame, **style: Any) -> None:
    """Draw means against sigma, with their intervals.

    Args:
        axes: to draw into.
        line: one measure, observer and shape of a summary.
        **style: of matplotlib's `errorbar`.
    """
    axes.errorbar(line["sigma_deg"], line["mean"], errors_of(line), marker="o", **style)


def errors_of(line: pd.DataFrame) -> np.ndarray:
    """Say how far intervals reach.

    Args:
        line: of a summary.

    Returns:
        (2, n) below and above the means; NaN, which is not drawn, of what too few trials tell of.
    """
    errors = np.array([line["mean"] - line["low"], line["high"] - line["mean"]], dtype=np.float64)
    return np.where(line["trials"] >= FEW, np.maximum(errors, 0.0), np.nan)


def draw_pose(axes: Axes, lines: pd.DataFrame) -> None:
    """Draw the lagged pose error of each observer against sigma.

    Args:
        axes: to draw into.
        lines: the measure pose_error_lagged_deg of a summary, of one shape or all.
    """
    for observer, line in lines.groupby("observer", sort=False):
        colour = OBSERVER_COLOURS.get(str(observer), "#882255")
        draw_curve(axes, line, capsize=3, color=colour, linewidth=2.5 if observer == SLAM else 1.2)
    axes.set(title="Pose error, lagged", xlabel="σ of the joint noise (degrees)", ylabel="RMS error (degrees)")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)


def _draw_bars(axes: Axes, lines: pd.DataFrame, title: str) -> None:
    observers = list(dict.fromkeys(lines["observer"]))
    noises = sorted(set(lines["sigma_deg"]))
    width = 0.8 / len(observers)
    for index, observer in enumerate(observers):
        line = lines[lines["observer"] == observer].sort_values("sigma_deg")
        place = np.arange(len(line)) - 0.4 + (index + 0.5) * width
        axes.bar(
            place,
            line["mean"],
            0.9 * width,
            yerr=errors_of(line),
            color=OBSERVER_COLOURS.get(observer, "#882255"),
            error_kw={"capsize": 2, "ecolor": "#D55E00", "linewidth": 1},
            label=OBSERVER_NAMES.get(observer, observer),
        )
        for where in place[line["mean"].isna()]:
            axes.text(where, 0.02, NOT_MADE, rotation=90, ha="center", va="bottom", color="#777777", fontsize=8)
    axes.set(
        title=title,
        xlabel="σ of the joint noise (degrees)",
        xticks=range(len(noises)),
        xticklabels=[f"{each:g}" for each in noises],
    )
    axes.set_xlim(-0.6, len(noises) - 0.4)
