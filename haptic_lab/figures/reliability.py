"""Reliability diagrams of the map: of the voxels beside the skin, into how many the object reaches against what the map
says. (A map of what was touched is one of surfaces: whether a voxel has its centre inside it cannot know.)"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from haptic_lab.analysis.reliability import OCCUPANCY, curves
from haptic_lab.analysis.summary import CEILING, FLOOR, SLAM
from haptic_lab.figures.paper_figure import WIDTH, PaperFigure
from haptic_lab.style import OBSERVER_COLOURS, OBSERVER_NAMES, OUTLINE, noise_colours


def draw(rows: pd.DataFrame) -> PaperFigure:
    """Draw into how many voxels the object reaches against the probability of the map.

    Args:
        rows: of the table of trials.

    Returns:
        Left for each noise, right between the brackets at the largest; below how many voxels.
    """
    data = curves(rows)
    data = data[data["what"] == OCCUPANCY].drop(columns="what").rename(columns={"count": "voxels"})
    sigmas = sorted(set(data["sigma_deg"]))
    shades = noise_colours(sigmas)
    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    panels = figure.subplots(2, 2, height_ratios=(3, 1), sharex=True, sharey="row")
    mine = data[data["observer"] == SLAM]
    left = [(mine[mine["sigma_deg"] == each], shades[each], f"σ = {each:g}°") for each in sigmas]
    last = data[data["sigma_deg"] == sigmas[-1]]
    right = [
        (last[last["observer"] == each], OBSERVER_COLOURS[each], OBSERVER_NAMES[each])
        for each in (FLOOR, SLAM, CEILING)
        if each in set(last["observer"])
    ]
    _column(panels[:, 0], "Haptic SLAM", left)
    _column(panels[:, 1], f"Between the brackets, σ = {sigmas[-1]:g}°", right)
    panels[0, 0].set_ylabel("voxels that the object\nreaches into (%)")
    panels[1, 0].set_ylabel("voxels")
    panels[0, 0].text(98, 30, "less often than said", ha="right", color="#777777", style="italic")
    panels[0, 0].text(2, 92, "more often than said", color="#777777", style="italic")
    return PaperFigure(figure, data)


def _column(panels: Iterable[Axes], title: str, curves: list[tuple[pd.DataFrame, str, str]]) -> None:
    above, below = panels
    above.plot([0, 100], [0, 100], color=OUTLINE, linewidth=1, linestyle=":", label="honest")
    for line, colour, label in curves:
        errors = 100 * np.maximum([line["found"] - line["low"], line["high"] - line["found"]], 0)
        above.errorbar(
            100 * line["said"], 100 * line["found"], errors, color=colour, label=label, marker="o", markersize=3,
            capsize=2, linewidth=1.2,
        )  # fmt: skip
        below.plot(100 * line["said"], line["voxels"], "o-", color=colour, markersize=3, linewidth=1.2)
    above.set(title=title, xlim=(-2, 102), ylim=(-2, 102))
    below.set(xlabel="the map says (%)", yscale="log")
    above.legend(loc="lower right", fontsize=7)
