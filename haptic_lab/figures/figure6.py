"""Figure 6 of the paper: how often the object is named right, against noise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from haptic_lab.analysis.summary import ALL, CEILING, FLOOR, SLAM, summarise
from haptic_lab.figures.paper_figure import WIDTH, PaperFigure
from haptic_lab.style import OBSERVER_COLOURS, OBSERVER_NAMES, OUTLINE, as_drawn, colours_of, titles_of
from haptic_lab.sweeps.results import names_in

TITLES = {
    "nearest_neighbour": "one-shot, Hamming\n(p > 0.5, as the paper)",
    "overlap_nearest_neighbour": "one-shot, Jaccard\n(touched voxels)",
    "shape_likelihood": "one-shot,\nshape likelihood",
    "shape_posterior": "ideal observer,\nknows the shapes",
}
SPREAD = 0.07  # degrees: between curves, so that their intervals can be told apart
PERCENT = 100.0


def draw(rows: pd.DataFrame) -> PaperFigure:
    """Draw how often objects are named right against noise.

    Args:
        rows: of the table of trials.

    Returns:
        Above the average over shapes between its brackets, below each shape; a column for each way to name.
    """
    namers = [name for name in TITLES if f"{name}_correct" in rows]
    data = summarise(rows, (), namers)[["measure", "observer", "shape", "sigma_deg", "mean", "low", "high", "trials"]]
    shapes = names_in(rows["candidates"].iloc[0])
    figure = Figure(figsize=(WIDTH, 4.8), layout="constrained")
    panels = figure.subplots(2, len(namers), sharex=True, sharey=True, squeeze=False)
    for column, namer in zip(panels.T, namers, strict=True):
        mine = data[data["measure"] == f"{namer}_correct"]
        _average(column[0], mine[mine["shape"] == ALL])
        _shapes(column[1], mine[mine["observer"] == SLAM], shapes)
        for axes in column:
            above = axes is column[0]
            axes.axhline(
                PERCENT / len(shapes), color="#777777", linestyle=":", linewidth=1, label="chance" if above else None
            )
        column[0].set_title(TITLES[namer])
        column[1].set_xlabel("σ of joint noise (°)")
    sigmas = sorted(set(data["sigma_deg"]))
    count, seconds = data[data["shape"] != ALL]["trials"].max(), rows["seconds"].iloc[0]
    told = f"{count} explorations of {seconds:g} s for each shape and σ, 95 % intervals"
    panels[0, 0].set(ylim=(-3, 104), xticks=sigmas, xticklabels=[f"{each:g}" for each in sigmas])
    panels[0, 0].set_ylabel("named right (%)\naverage of all shapes")
    panels[1, 0].set_ylabel("named right (%)\nhaptic SLAM, each shape")
    for row in (0, 1):
        handles, labels = panels[row, 0].get_legend_handles_labels()
        place: Any = ("outside upper center", "outside lower center")[row]
        figure.legend(handles, labels, loc=place, ncols=len(labels), title=None if row else told)
    return PaperFigure(figure, data)


def _average(axes: Axes, lines: pd.DataFrame) -> None:
    brackets = [lines[lines["observer"] == name].sort_values("sigma_deg") for name in (FLOOR, CEILING)]
    if all(map(len, brackets)):
        axes.fill_between(
            brackets[0]["sigma_deg"],
            PERCENT * brackets[0]["mean"].to_numpy(),
            PERCENT * brackets[1]["mean"].to_numpy(),
            color="#F0F0F0",
            linewidth=0,
        )
    observers = [name for name in (CEILING, SLAM, FLOOR) if name in set(lines["observer"])]
    for index, name in enumerate(observers):
        _curve(
            axes,
            lines[lines["observer"] == name],
            (index - 0.5 * (len(observers) - 1)) * SPREAD,
            color=OBSERVER_COLOURS[name],
            label=OBSERVER_NAMES[name],
            linewidth=2.0 if name == SLAM else 1.2,
        )


def _shapes(axes: Axes, lines: pd.DataFrame, shapes: list[str]) -> None:
    colours, titles = colours_of(shapes), titles_of(shapes)
    for index, shape in enumerate(shapes):
        shift = (index - 0.5 * (len(shapes) - 1)) * SPREAD
        named: Any = {"color": colours[shape], "label": as_drawn(titles[shape])}
        _curve(axes, lines[lines["shape"] == shape], shift, linewidth=1.2, **named)
    _curve(axes, lines[lines["shape"] == ALL], 0.0, color=OUTLINE, label="average", linewidth=2.0)


def _curve(axes: Axes, line: pd.DataFrame, shift: float, **style: Any) -> None:
    line = line.sort_values("sigma_deg")
    mean, low, high = (PERCENT * line[name].to_numpy() for name in ("mean", "low", "high"))
    errors = np.maximum([mean - low, high - mean], 0.0)
    axes.errorbar(line["sigma_deg"] + shift, mean, errors, marker="o", markersize=3, elinewidth=0.8, **style)
