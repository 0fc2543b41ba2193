"""How soon maps are named right, beside names from the whole stream of beliefs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich import box
from rich.console import Console
from rich.table import Table

from haptic_env import validate
from haptic_lab.analysis.reliability import numbers_of
from haptic_lab.analysis.statistics import FEW, told_of_trials
from haptic_lab.analysis.summary import CEILING, FLOOR, NAMERS, SLAM
from haptic_lab.files import write_table
from haptic_lab.style import OBSERVER_NAMES, SPARE
from haptic_lab.sweeps.measures import COURSE_SECONDS
from haptic_lab.sweeps.rows import course_of
from haptic_lab.sweeps.tasks import STREAM
from observer import metrics

NAME = "names_through_time"
COLUMNS = ["sigma_deg", "observer", "namer", "seconds", "mean", "low", "high", "trials"]
STYLES = {SLAM: "-", CEILING: ":", FLOOR: "--"}
MOST_TIMES = 8  # columns of what is printed
STREAM_COLOUR = "#000000"


def curves(rows: pd.DataFrame, classifiers: Sequence[str], every: float) -> pd.DataFrame:
    """Summarise how often names were right, through time.

    Args:
        rows: of the table of trials of a sweep that had `maps_every`.
        classifiers: of maps.
        every: s from one map to the next.

    Returns:
        A line for each noise, observer, namer and time: `mean`, 95 % interval (`low`, `high`; Wilson), `trials`; of
        the shape posterior at its own times. Observers without maps have none of the classifiers.
    """
    lines = []
    for (sigma, observer), group in rows.groupby(["sigma_deg", "observer"], sort=False):
        for namer in (STREAM, *classifiers):
            column, step = ("course_correct", COURSE_SECONDS) if namer == STREAM else (course_of(namer), every)
            right = numbers_of(group[column])
            for k in range(right.shape[1]):
                lines.append((sigma, observer, namer, (k + 1) * step, *metrics.accuracy(right[:, k])))
    return pd.DataFrame(lines, columns=COLUMNS)


def draw(lines: pd.DataFrame, chance: float) -> Figure:
    """Draw what `curves` found.

    Args:
        lines: of `curves`.
        chance: how often a guess is right, in [0, 1].

    Returns:
        A panel for each noise, a colour for each namer, a line for the observer and its brackets.
    """
    sigmas, namers = sorted(set(lines["sigma_deg"])), list(dict.fromkeys(lines["namer"]))
    there = dict.fromkeys(lines["observer"])
    shown = [each for each in STYLES if each in there] or list(there)[:1]
    colours = dict(zip(namers, (STREAM_COLOUR, *SPARE * len(namers)), strict=False))
    figure = Figure(figsize=(max(8.0, 1.5 + 3.2 * len(sigmas)), 4.6), layout="constrained")
    panels = figure.subplots(1, len(sigmas), sharey=True, squeeze=False)[0]
    for axes, sigma in zip(panels, sigmas, strict=True):
        mine = lines[lines["sigma_deg"] == sigma]
        for observer in shown:
            for namer in namers:
                line = mine[(mine["observer"] == observer) & (mine["namer"] == namer)]
                axes.plot(line["seconds"], line["mean"], STYLES.get(observer, "-"), color=colours[namer], linewidth=1.4)
                if observer == shown[0] and len(line) and line["trials"].max() >= FEW:
                    band = {"color": colours[namer], "alpha": 0.12, "linewidth": 0}
                    axes.fill_between(line["seconds"], line["low"], line["high"], **band)
        axes.axhline(chance, color="#777777", linestyle=":", linewidth=1)
        axes.set(title=f"σ = {sigma:g}°", xlabel="exploration (s)", ylim=(0, 1.02))
        axes.set_xlim(left=0)
    panels[0].set(ylabel="share named right")
    for namer in namers:
        panels[0].plot([], [], color=colours[namer], label=NAMERS.get(namer, namer.replace("_", " ")))
    for observer in shown:
        style = STYLES.get(observer, "-")
        panels[0].plot([], [], style, color="#777777", label=OBSERVER_NAMES.get(observer, observer))
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    trials = int(lines["trials"].max())
    told = told_of_trials(trials, f"shaded: 95 % intervals of {OBSERVER_NAMES.get(shown[0], shown[0])}")
    many = validate.counted(trials, "exploration")
    figure.suptitle(f"{many} for each noise, {told}; grey dots: chance", fontsize=10)
    return figure


def save(lines: pd.DataFrame, chance: float, folder: Path) -> list[str]:
    """Write names_through_time.csv and its picture.

    Args:
        lines: of `curves`.
        chance: as `draw`'s.
        folder: to write to.

    Returns:
        The names of the files; none where there is not one line.
    """
    return write_table(folder, NAME, lines, draw(lines, chance)) if len(lines) else []


def print_table(lines: pd.DataFrame, console: Console) -> None:
    """Print how often names are right after some of the times at which all namers were asked.

    Args:
        lines: of `curves`.
        console: to print to.
    """
    asked = [set(mine["seconds"].round(6)) for _, mine in lines.groupby("namer")]
    times = sorted(set.intersection(*asked)) if asked else []
    if not times:
        return
    chosen = [times[k] for k in np.unique(np.linspace(0, len(times) - 1, MOST_TIMES).round().astype(int))]
    title = "Named right through time: the stream of beliefs, and maps in hindsight"
    result = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    for name in ("σ", "observer", "namer", *(f"{time:g} s" for time in chosen)):
        result.add_column(name, justify="left" if name in ("observer", "namer") else "right")
    for (sigma, observer, namer), mine in lines.groupby(["sigma_deg", "observer", "namer"], sort=False):
        at = mine.assign(seconds=mine["seconds"].round(6)).set_index("seconds")["mean"]
        result.add_row(f"{sigma:g}°", str(observer), str(namer), *(f"{at[time]:.0%}" for time in chosen))
    console.print(result)
