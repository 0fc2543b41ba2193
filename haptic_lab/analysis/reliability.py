"""Whether beliefs are as sure as they may be: of the joint angles, of the voxels and of the name.

Shapes: T trials, B bins.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from haptic_env import validate
from haptic_lab.analysis.statistics import interval
from haptic_lab.files import atomic, write_csv
from haptic_lab.style import OBSERVER_NAMES, OUTLINE, noise_colours
from haptic_lab.sweeps.measures import SKIN_CELLS
from haptic_lab.sweeps.results import labels_in, right_names
from observer import metrics

LEVELS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
LAGGED, ONLINE, OCCUPANCY, NAME = "angles, lagged", "angles, online", "occupancy", "name"
BELOW = ("too sure", "less often than said", "less often than said")
ABOVE = ("too modest", "more often than said", "more often than said")
NAME_BINS = 5  # trials are few
RESAMPLES = 500
Line = tuple[str, float, float, float, float, int]  # what, said, found, low, high, count


def curves(rows: pd.DataFrame) -> pd.DataFrame:
    """Compare how sure beliefs were with how often they were right.

    Angles: how often the central interval of that probability holds the truth (interval: Student's t over trials).
    Occupancy: of the voxels that the skin swept or that share a face with one, those of about that probability, and
    whether the object reached into them (bootstrap over trials). Name: labels of about it (Wilson).

    Args:
        rows: of the table of trials.

    Returns:
        A line for each noise, observer, thing that is believed (`what`) and level: the share that was `said`, the one
        that was `found` with its 95 % interval (`low`, `high`), and `count` of what it was found in.
    """
    lines = []
    for (sigma, observer), group in rows.groupby(["sigma_deg", "observer"], sort=False):
        found = [*_angles(group, LAGGED), *_angles(group, ONLINE), *_occupancy(group), *_name(group)]
        lines += [(sigma, observer, *line) for line in found]
    return pd.DataFrame(lines, columns=["sigma_deg", "observer", "what", "said", "found", "low", "high", "count"])


def save(rows: pd.DataFrame, folder: Path) -> list[str]:
    """Write calibration.csv, and a picture for each observer.

    Args:
        rows: of the table of trials.
        folder: to write to.

    Returns:
        The names of the files.
    """
    lines = curves(rows)
    write_csv(folder / "calibration.csv", lines)
    names = ["calibration.csv"]
    for observer in dict.fromkeys(rows["observer"]):
        names.append(f"calibration_{observer}.png")
        figure = draw(lines[lines["observer"] == observer], rows[rows["observer"] == observer])
        with atomic(folder / names[-1]) as place:
            figure.savefig(place)
    return names


def draw(lines: pd.DataFrame, rows: pd.DataFrame) -> Figure:
    """Draw said against found (top), and how much was said (bottom), a colour for each noise.

    Args:
        lines: what `curves` returns, of one observer.
        rows: of the table of trials, of the same.

    Returns:
        Joint angles, voxels and names side by side.
    """
    figure = Figure(figsize=(12, 6.5), layout="constrained")
    panels = figure.subplots(2, 3, height_ratios=(3, 1))
    colours = noise_colours(sorted(set(lines["sigma_deg"])))
    for column, (what, title, axis) in enumerate(
        [
            (LAGGED, "Joint angles: does the interval hold the truth?", "probability of the interval"),
            (OCCUPANCY, "Voxels at the skin: is the object in them?", "probability that the object reaches into it"),
            (NAME, "Name: is it right as often as said?", "probability of a name"),
        ]
    ):
        top, bottom = panels[0, column], panels[1, column]
        top.plot([0, 1], [0, 1], color=OUTLINE, linewidth=1, linestyle=":")
        for sigma, line in lines[lines["what"] == what].groupby("sigma_deg"):
            errors = np.maximum([line["found"] - line["low"], line["high"] - line["found"]], 0)
            colour = colours[sigma]
            top.errorbar(line["said"], line["found"], errors, color=colour, capsize=2, linewidth=1, alpha=0.5)
            size = 25.0 if what == LAGGED else 8 + 22 * np.log10(line["count"])  # what rests on little is small
            top.scatter(line["said"], line["found"], size, color=colour, label=f"σ = {sigma:g}°", zorder=3)
        top.set(title=title, xlabel=axis, ylabel="share found", xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
        if what != LAGGED:
            _draw_counts(bottom, lines[lines["what"] == what], colours, axis)
    for panel, below, above in zip(panels[0], BELOW, ABOVE, strict=True):
        panel.text(0.98, 0.07, below, ha="right", color="#777777", style="italic")
        panel.text(0.03, 0.9, above, color="#777777", style="italic")
    panels[0, 0].legend(loc="center left", bbox_to_anchor=(0.0, 0.68))
    _draw_ranks(panels[1, 0], rows, colours)
    observer = str(rows["observer"].iloc[0])
    trials = int(rows.groupby("sigma_deg").size().max())
    figure.suptitle(
        f"Calibration, {OBSERVER_NAMES.get(observer, observer)}: "
        f"{validate.counted(trials, 'exploration')} for each σ; dotted: honest",
        fontsize=12,
        fontweight="bold",
    )
    return figure


def _angles(group: pd.DataFrame, what: str) -> Iterator[Line]:
    counts = numbers_of(group["ranks_lagged" if what == LAGGED else "ranks_online"])  # (T, B)
    share = counts / counts.sum(axis=1, keepdims=True)
    bins = counts.shape[1]
    for level in LEVELS:
        beyond = round(0.5 * (1 - level) * bins)
        yield (what, level, *interval(share[:, beyond : bins - beyond].sum(axis=1)))


def _occupancy(group: pd.DataFrame) -> Iterator[Line]:
    cells, said, found = (numbers_of(group[name]) for name in SKIN_CELLS)  # (T, B)
    said, found = (np.where(cells > 0, cells * each, 0.0) for each in (said, found))
    draws = np.random.default_rng(0).integers(len(cells), size=(RESAMPLES, len(cells)))
    for b in range(cells.shape[1]):
        total = cells[:, b].sum()
        if total == 0:
            continue
        drawn = cells[draws, b].sum(axis=1)
        shares = found[draws, b].sum(axis=1)[drawn > 0] / drawn[drawn > 0]
        low, high = np.percentile(shares, [2.5, 97.5])
        yield OCCUPANCY, said[:, b].sum() / total, found[:, b].sum() / total, low, high, int(total)


def _name(group: pd.DataFrame) -> Iterator[Line]:
    labels = labels_in(group)
    said = group[[f"p_{label}" for label in labels]].to_numpy()
    right = np.array(right_names(group))[:, None] == np.array(labels)
    which = np.minimum((said * NAME_BINS).astype(int), NAME_BINS - 1)
    for b in range(NAME_BINS):
        inside = which == b
        if inside.any():
            yield (NAME, float(said[inside].mean()), *metrics.accuracy(right[inside]))


def numbers_of(column: pd.Series) -> np.ndarray:
    """Read a column of which each field holds several numbers, with spaces between them.

    Args:
        column: (T,) of equally many numbers each, which may be none.

    Returns:
        (T, B) the numbers.
    """
    # pandas takes a field of one number for a number, and an empty one for NaN.
    return np.array([[float(each) for each in str(text).split()] for text in column.astype(object).fillna("")])


def _draw_ranks(axes: Axes, rows: pd.DataFrame, colours: dict[float, str]) -> None:
    for sigma, group in rows.groupby("sigma_deg"):
        counts = numbers_of(group["ranks_lagged"]).sum(axis=0)
        counts = counts.reshape(20, -1).sum(axis=1)
        axes.stairs(counts / counts.mean(), np.linspace(0, 1, 21), color=colours[sigma], linewidth=1.5)
    axes.axhline(1, color=OUTLINE, linewidth=1, linestyle=":")
    axes.set(xlabel="rank of the true angle (flat: honest)", ylabel="frequency", ylim=(0, None), xlim=(-0.02, 1.02))


def _draw_counts(axes: Axes, lines: pd.DataFrame, colours: dict[float, str], axis: str) -> None:
    for sigma, line in lines.groupby("sigma_deg"):
        axes.plot(line["said"], line["count"], "o-", color=colours[sigma], markersize=4)
    axes.set(xlabel=axis, ylabel="how many", yscale="log", xlim=(-0.02, 1.02))
    axes.set_ylim(0.8, 2 * lines["count"].max())
    axes.yaxis.set_minor_formatter(NullFormatter())
