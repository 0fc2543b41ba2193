"""Figure 6 of the paper: how often the object is named right, against noise.

Above, names from the last map by what one map of each shape has taught, as the paper has it: first its own recursion,
then this project's. Below, names from all that was felt until 2, 5 and 10 s.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from haptic_env import validate
from haptic_lab.analysis.statistics import FEW, told_of_trials
from haptic_lab.analysis.summary import ALL, CEILING, FLOOR, NAMERS, SLAM, errors_of, summarise
from haptic_lab.figures.paper_figure import WIDTH, PaperFigure
from haptic_lab.style import OBSERVER_COLOURS, OBSERVER_NAMES, OUTLINE, as_drawn, colours_of, titles_of
from haptic_lab.sweeps.measures import AFTER_SECONDS
from haptic_lab.sweeps.results import names_in
from haptic_lab.sweeps.tasks import STREAM

PAPER = "paper"
AS_THE_PAPER = "nearest_neighbour"  # how it names
TITLES = NAMERS
SPREAD = 0.07  # degrees: between curves, so that their intervals can be told apart
PERCENT = 100.0
CHANCE = "chance"
MISSING = "no trials of the\npaper's recursion here"
COLUMNS = ["measure", "observer", "shape", "sigma_deg", "mean", "low", "high", "trials"]


def draw(rows: pd.DataFrame) -> PaperFigure:
    """Draw how often objects are named right against noise.

    Args:
        rows: of the table of trials; those of the observer `PAPER` may be fewer.

    Returns:
        Above a panel for each way to name from the last map, below one for each time.
    """
    namers = [name for name in TITLES if f"{name}_correct" in rows]
    times = {f"correct_{after}s": float(after) for after in AFTER_SECONDS if rows[f"correct_{after}s"].notna().any()}
    data = summarise(rows, list(times), namers)[COLUMNS]
    data = data[data["trials"] > 0]  # the paper's recursion is not named by all
    seconds = float(rows["seconds"].iloc[0])
    if seconds not in times.values():
        times[f"{STREAM}_correct"] = seconds
    shapes = names_in(rows["candidates"].iloc[0])
    above: list[tuple[str, Callable[[Axes], object]]] = []
    if AS_THE_PAPER in namers:
        one_shot = data[data["measure"] == f"{AS_THE_PAPER}_correct"]
        averages = one_shot[one_shot["shape"] == ALL]
        above += [
            ("as the paper has it:\nits recursion, its names", lambda axes: _shapes(axes, one_shot, PAPER, shapes)),
            ("this recursion,\nthe paper's names", lambda axes: _shapes(axes, one_shot, SLAM, shapes)),
            ("the paper's names, all shapes,\nby recursion", lambda axes: _average(axes, averages)),
        ]
    count = 1 + bool(above)
    figure = Figure(figsize=(WIDTH, 0.9 + 1.95 * count), layout="constrained")
    parts: Any = figure.subfigures(count, 1, squeeze=False).ravel()
    sigmas = sorted(set(data["sigma_deg"]))
    chance = PERCENT / len(shapes)
    if above:
        panels = all_above = parts[0].subplots(1, len(above), sharex=True, sharey=True, squeeze=False)[0]
        for axes, (title, fill) in zip(panels, above, strict=True):
            fill(axes)
            axes.set_title(title)
            axes.axhline(chance, color="#777777", linestyle=":", linewidth=1, label=CHANCE)
            axes.set_xlabel("σ of joint noise (°)")
        panels[0].set(ylim=(-3, 104), ylabel="named right from one map (%)")
        panels[0].set_xticks(sigmas, [f"{each:g}" for each in sigmas])
        _legend(parts[0], panels[-2])
    panels = parts[-1].subplots(1, len(times), sharex=True, sharey=True, squeeze=False)[0]
    lowest = PERCENT
    for axes, (measure, after) in zip(panels, times.items(), strict=True):
        mine = data[(data["measure"] == measure) & (data["shape"] == ALL) & (data["observer"] != PAPER)]
        lowest = min(lowest, _average(axes, mine))
        axes.set(title=f"shapes known,\nafter {after:g} s", xlabel="σ of joint noise (°)")
    bottom = max(0.0, 10.0 * np.floor(lowest / 10.0))
    panels[0].set(ylim=(bottom - 0.03 * (PERCENT - bottom), PERCENT + 0.04 * (PERCENT - bottom)))
    panels[0].set_ylabel(f"named right (%{f', from {bottom:.0f} %' if bottom else ''})\naverage of all shapes")
    panels[0].set_xticks(sigmas, [f"{each:g}" for each in sigmas])
    _legend(parts[-1], *([all_above[-1]] if above else []), panels[0])
    figure.suptitle(_told(data, seconds), fontsize=8)
    return PaperFigure(figure, data)


def _told(data: pd.DataFrame, seconds: float) -> str:
    """Of how many explorations the panels are."""
    each = data[data["shape"] != ALL].groupby("observer")["trials"].max()
    ours = int(each.drop(PAPER, errors="ignore").max())
    told = f"{validate.counted(ours, 'exploration')} of {seconds:g} s for each shape and σ"
    if PAPER in each and each[PAPER] != ours:
        told += f" ({each[PAPER]} of the paper's recursion)"
    return f"{told}; {told_of_trials(ours)}{f' of {FEW} or more' if each.min() < FEW <= ours else ''}"


def _legend(part: Any, *panels: Axes) -> None:
    found: dict[str, Any] = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        found |= {label: handle for label, handle in zip(labels, handles, strict=True) if label not in found}
    if len(panels) > 1:
        found.pop(CHANCE, None)  # it is told above
    part.legend(found.values(), found, loc="outside lower center", ncols=len(found))


def _average(axes: Axes, lines: pd.DataFrame) -> float:
    """Draw the averages of observers, floor and ceiling, and tell the lowest of their intervals, in percent."""
    brackets = [lines[lines["observer"] == name].sort_values("sigma_deg") for name in (FLOOR, CEILING)]
    if all(map(len, brackets)):
        ends = (PERCENT * each["mean"].to_numpy() for each in brackets)
        axes.fill_between(brackets[0]["sigma_deg"], *ends, color="#F0F0F0", linewidth=0)
    observers = [name for name in (CEILING, SLAM, PAPER, FLOOR) if name in set(lines["observer"])]
    for index, name in enumerate(observers):
        _curve(
            axes,
            lines[lines["observer"] == name],
            (index - 0.5 * (len(observers) - 1)) * SPREAD,
            color=OBSERVER_COLOURS[name],
            label=OBSERVER_NAMES[name],
            linewidth=2.0 if name == SLAM else 1.2,
        )
    shown = lines[lines["observer"].isin(observers)]
    return PERCENT * float(np.where(shown["trials"] >= FEW, shown["low"], shown["mean"]).min())


def _shapes(axes: Axes, lines: pd.DataFrame, observer: str, shapes: list[str]) -> None:
    lines = lines[lines["observer"] == observer]
    if lines.empty:
        axes.text(0.5, 0.5, MISSING, transform=axes.transAxes, ha="center", va="center", color="#777777")
        return
    colours, titles = colours_of(shapes), titles_of(shapes)
    for index, shape in enumerate(shapes):
        shift = (index - 0.5 * (len(shapes) - 1)) * SPREAD
        named: Any = {"color": colours[shape], "label": as_drawn(titles[shape])}
        _curve(axes, lines[lines["shape"] == shape], shift, linewidth=1.2, **named)
    _curve(axes, lines[lines["shape"] == ALL], 0.0, color=OUTLINE, label="average", linewidth=2.0)


def _curve(axes: Axes, line: pd.DataFrame, shift: float, **style: Any) -> None:
    line = line.sort_values("sigma_deg")
    mean, errors = PERCENT * line["mean"].to_numpy(), PERCENT * errors_of(line)
    axes.errorbar(line["sigma_deg"] + shift, mean, errors, marker="o", markersize=3, elinewidth=0.8, **style)
