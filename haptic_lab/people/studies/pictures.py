"""Pictures of a study: thresholds against noise, or names in each condition, with what was published."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from haptic_lab.people.studies.discrimination import ENDS
from haptic_lab.people.studies.presets import Study
from haptic_lab.style import OBSERVER_COLOURS, OBSERVER_NAMES, OUTLINE, SPARE, as_drawn

ORDER = ("floor", "haptic_slam", "ceiling")
PEOPLE = "#D55E00"
SPREAD = 1.03  # of sigma between curves, so that their intervals can be told apart
PERCENT = 100.0
LETTER, HANDLE = 0.075, 0.6  # inches, of a legend
DASHES: Any = ((0, (4, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))


def thresholds(lines: pd.DataFrame, study: Study) -> Figure:
    """Draw thresholds against the noise of felt angles.

    Args:
        lines: of `discrimination.thresholds`.
        study: the experiment.

    Returns:
        The figure: a panel for each condition and duration.
    """
    panels = list(lines.groupby(["condition", "seconds"], sort=False))
    figure = Figure(figsize=(1.0 + 5.0 * len(panels), 4.4), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for panel, ((condition, seconds), group) in zip(axes, panels, strict=True):
        _published(panel, study)
        for name, shift, colour in _observers(group):
            line = group[(group["observer"] == name) & group["threshold"].notna()].sort_values("sigma_deg")
            if line.empty:  # all answers were right, say: the table tells
                continue
            at, low, high = ((line[each] - study.standard).abs().to_numpy(float) for each in ENDS)
            place, errors = line["sigma_deg"] * SPREAD**shift, np.maximum([at - low, high - at], 0.0)
            label = as_drawn(OBSERVER_NAMES.get(name, name))
            panel.errorbar(place, at, errors, color=colour, label=label, marker="o", markersize=4, elinewidth=1.0)
            beyond = ~line["within"].to_numpy(bool)
            panel.plot(place[beyond], at[beyond], "o", color=colour, markerfacecolor="white", markersize=4, zorder=3)
        sigmas = sorted(set(group["sigma_deg"]))
        panel.set(xscale="log", yscale="log", xlabel="σ of joint noise (°)", title=_title(condition, seconds))
        panel.set_xticks(sigmas, [f"{each:g}" for each in sigmas])
        panel.xaxis.set_minor_formatter(NullFormatter())
        nearest, *_, farthest = (abs(value - study.standard) for value, _ in study.comparisons)
        panel.set_ylim(0.4 * nearest, 2.0 * farthest)
        _by_value(panel, study)
    axes[0].set_ylabel(f"threshold of {study.parameter}{study.unit and f' ({study.unit})'}")
    told = f"{study.title}\n{100 * 0.5 * (1 + study.guess):g} % right, 95 % intervals"
    fitted = lines[lines["threshold"].notna()]
    figure.suptitle(told if fitted["within"].all() else f"{told}; open: beyond the stimuli", fontsize=10)
    _legend(figure, axes)
    return figure


def accuracy(lines: pd.DataFrame, study: Study) -> Figure:
    """Draw how often objects are named right.

    Args:
        lines: of `identification.accuracy`.
        study: the experiment.

    Returns:
        The figure: a panel for each sigma, conditions side by side, or observers where there is one condition.
    """
    panels = list(lines.groupby("sigma_deg"))
    figure = Figure(figsize=(1.0 + 4.0 * len(panels), 4.0), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for panel, (sigma, group) in zip(axes, panels, strict=True):
        curves = list(group.groupby(["condition", "observer"], sort=False))
        colours = cycle((OUTLINE, *SPARE))
        strokes = dict(zip(dict.fromkeys(group["condition"]), cycle(("-", *DASHES)), strict=False))
        several = group["observer"].nunique() > 1
        for number, ((condition, observer), line) in enumerate(curves):
            name = OBSERVER_NAMES.get(observer, observer)
            label = ", ".join(each for each in (condition, name if several or not condition else "") if each)
            # Of several observers the colour says which, and the stroke under which condition.
            colour = OBSERVER_COLOURS.get(observer, OUTLINE) if several or not condition else next(colours)
            stroke: Any = strokes[condition] if several else "-"
            mean, low, high = (PERCENT * line[each].to_numpy() for each in ("mean", "low", "high"))
            shown: Any = {"color": colour, "label": as_drawn(label), "markersize": 4, "elinewidth": 1.0}
            panel.errorbar(
                line["after"] * SPREAD ** (number - len(curves) / 2),
                mean,
                np.maximum([mean - low, high - mean], 0.0),
                marker="o",
                linestyle=stroke,
                **shown,
            )
        panel.set(xlabel="explored for (s)", title=f"σ = {sigma:g}°", ylim=(-3, 104))
        panel.set_xticks(sorted(set(group["after"])))
    for published in study.published:
        if published.drawn and published.seconds is not None:
            axes[0].plot(
                published.seconds, PERCENT * published.value, "*", color=PEOPLE, label=as_drawn(published.what)
            )
    axes[0].set_ylabel("named right (%)")
    figure.suptitle(f"{study.title}\n95 % intervals, {lines['trials'].max()} explorations each", fontsize=10)
    _legend(figure, axes)
    return figure


def _observers(group: pd.DataFrame) -> list[tuple[str, float, str]]:
    """Each observer with how far it is shifted, and its colour."""
    there = list(dict.fromkeys(group["observer"]))
    names = [name for name in ORDER if name in there] + [name for name in there if name not in ORDER]
    spare = iter(cycle(SPARE))
    return [(name, i - (len(names) - 1) / 2, OBSERVER_COLOURS.get(name) or next(spare)) for i, name in enumerate(names)]


def _published(panel: Axes, study: Study) -> None:
    for figure, dashes in zip((each for each in study.published if each.drawn), cycle(DASHES), strict=False):
        label = as_drawn(f"people, {figure.value:g}")
        panel.axhline(abs(figure.value - study.standard), color=PEOPLE, linestyle=dashes, linewidth=1.5, label=label)


def _by_value(panel: Axes, study: Study) -> None:
    """Ticks say the parameter, not how far it is from the standard."""
    low, high = panel.get_ylim()
    steps = [
        m * 10.0**k for k in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1) for m in (1, 2, 5)
    ]
    ticks = [each for each in steps if low <= each <= high]
    sign = math.copysign(1.0, study.comparisons[0][0] - study.standard)
    panel.set_yticks(ticks, [f"{study.standard + sign * each:.6g}" for each in ticks])
    panel.yaxis.set_minor_formatter(NullFormatter())
    panel.set_ylim(low, high)


def _title(condition: str, seconds: float) -> str:
    return ", ".join(each for each in (condition, f"{seconds:g} s of touch") if each)


def _legend(figure: Figure, panels: Iterable[Axes]) -> None:
    told = [zip(*axes.get_legend_handles_labels(), strict=True) for axes in panels]
    shown = {label: handle for each in told for handle, label in each}
    if shown:
        fit_in = int(figure.get_figwidth() / (LETTER * max(map(len, shown)) + HANDLE))
        columns = min(3, max(1, fit_in), len(shown))
        figure.legend([*shown.values()], [*shown], loc="outside lower center", ncols=columns)
