"""Pictures of people beside observers: d′ and efficiency, agreement trial by trial, times of decisions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from haptic_lab.figures.paper_figure import WIDTH
from haptic_lab.people.matching import Match
from haptic_lab.people.pictures import MOST_PANELS, PEOPLE_COLOUR, SUBJECTS, colours_of_observers, wrapped
from haptic_lab.people.summaries import over_all_times
from haptic_lab.style import as_drawn

MOST_ROWS = 24  # subjects and observers of a picture
ROW = 0.22  # inches


def sensitivities(detection: pd.DataFrame, efficiency: pd.DataFrame, observers: Sequence[str]) -> Figure:
    """Draw d′ of people and observers, and efficiencies against these, over all times.

    Args:
        detection: of `sensitivity_tables.detection`.
        efficiency: of `sensitivity_tables.efficiencies`.
        observers: whose are shown.

    Returns:
        A row for all people, each observer and each subject; of several conditions without subjects.
    """
    lines = over_all_times(detection)
    several = lines["condition"].nunique() > 1
    kinds = {"people": 0, "observer": 1, "subject": 2}
    lines = lines[(lines["kind"] != "observer") | lines["who"].isin(list(observers))]
    subjects = lines[lines["kind"] == "subject"]
    if several or len(subjects) == 1:  # who is all people
        lines = lines[lines["kind"] != "subject"]
    lines = lines.sort_values("kind", key=lambda kind: kind.map(kinds), kind="stable").iloc[:MOST_ROWS]
    names = [as_drawn(f"{line.who}, {line.condition}" if several else line.who) for line in lines.itertuples()]
    colours = colours_of_observers(observers)
    figure = Figure(figsize=(WIDTH, 1.5 + ROW * max(len(lines), 3)), layout="constrained")
    panels = figure.subplots(1, 1 + bool(observers), sharey=True, squeeze=False)[0]
    for row, line in enumerate(lines.itertuples()):
        colour = SUBJECTS if line.kind == "subject" else colours[line.who]
        low, high = line.d_prime_low, line.d_prime_high
        if line.perfect:
            panels[0].annotate(
                "", (low + 0.6, row), (low, row), arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 1.8}
            )
            panels[0].text(low + 0.65, row, "no mistake", va="center", fontsize=7.5, color=colour)
            panels[0].plot(low, row, "|", color=colour, markersize=8)
        else:
            _interval(panels[0], line.d_prime, low, high, row, colour)
    panels[0].set(yticks=range(len(lines)), yticklabels=names, xlabel="d′")
    panels[0].set_ylim(len(lines) - 0.4, -0.6)
    panels[0].axvline(0, color="#777777", linewidth=0.8)
    panels[0].set_xlim(
        right=1.25 * max(1.0, np.max(np.where(lines["perfect"], lines["d_prime_low"] + 1, lines["d_prime_high"])))
    )
    if observers:
        _draw_efficiencies(panels[1], efficiency, lines, observers)
        figure.legend(*panels[1].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    what = "Sensitivity and efficiency" if observers else "Sensitivity"
    figure.suptitle(f"{what}, 95 % intervals", fontweight="bold", fontsize=10)
    return figure


def _draw_efficiencies(axes: Axes, table: pd.DataFrame, rows: pd.DataFrame, observers: Sequence[str]) -> None:
    colours = colours_of_observers(observers)
    table = over_all_times(table)
    ends = table["high"].replace(math.inf, math.nan).dropna()
    end = max(110.0, min(100.0 * float(ends.max()) if len(ends) else 0.0, 300.0))
    for row, line in enumerate(rows.itertuples()):
        if line.kind == "observer":
            continue
        for index, label in enumerate(observers):
            there = (table["who"] == line.who) & (table["condition"] == line.condition)
            mine = table[there & (table["observer"] == label)]
            if mine.empty:
                continue
            value, low, high = mine[["efficiency", "low", "high"]].iloc[0]
            place = row + 0.22 * (index - 0.5 * (len(observers) - 1))
            if math.isnan(value) and math.isinf(high):
                axes.plot(min(100 * low, end), place, ">", color=colours[label], markersize=4, clip_on=False)
            elif math.isnan(value):
                axes.annotate(
                    "", (0, place), (100 * high, place), arrowprops={"arrowstyle": "->", "color": colours[label]}
                )
            else:
                _interval(axes, 100 * value, 100 * low, 100 * high, place, colours[label])
    axes.axvline(100, color="#777777", linestyle=":", linewidth=1)
    axes.set(xlabel="efficiency (d′ of people / d′ of the observer)², %")
    axes.set_xlim(0, end)
    for label in observers:
        axes.plot([], [], "o-", color=colours[label], label=f"against {as_drawn(label)}")
    bounds = table[table["observer"].isin(list(observers)) & table["efficiency"].isna()]
    if np.isfinite(bounds["high"]).any():
        axes.plot([], [], color="#777777", label="below this: no more is known", marker="<", linestyle="-")
    if np.isinf(bounds["high"]).any():
        axes.plot([], [], ">", color="#777777", label="above this: people made no mistake", markersize=4)


def agreements(table: pd.DataFrame, observers: Sequence[str], answers: int) -> Figure:
    """Draw how well observers say what people answered.

    Args:
        table: of `summaries.agreement`.
        observers: whose are shown, the best first.
        answers: C, of which chance is 1 / C.

    Returns:
        A panel for the probability of people's answers, κ and information; a row for each observer.
    """
    figure = Figure(figsize=(WIDTH, 1.4 + 0.38 * len(observers)), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    for row, label in enumerate(observers):
        mine = table[table["observer"] == label]
        each, all_ = mine.iloc[1:], mine.iloc[0]
        if len(each) > 1:
            for axes, name in zip(panels, ("nats", "kappa", "bits"), strict=True):
                values = 100 * np.exp(each[name]) if name == "nats" else _corrected(each, name)
                axes.plot(values, np.full(len(each), row), "|", color=SUBJECTS, markersize=9, zorder=1)
        middle, low, high = (100 * math.exp(all_[name]) for name in ("nats", "nats_low", "nats_high"))
        _interval(panels[0], middle, low, high, row, PEOPLE_COLOUR)
        for axes, name in zip(panels[1:], ("kappa", "bits"), strict=True):
            axes.plot(_corrected(all_, name), row, "o", color=PEOPLE_COLOUR, markersize=6)
    panels[0].axvline(100 / answers, color="#777777", linestyle=":", linewidth=1)
    panels[0].text(100 / answers, -0.45, " chance", fontsize=7.5, color="#555555", va="center")
    panels[1].axvline(0, color="#777777", linestyle=":", linewidth=1)
    panels[0].set(
        yticks=range(len(observers)),
        yticklabels=[as_drawn(each) for each in observers],
        ylim=(len(observers) - 0.5, -0.6),
    )
    panels[0].set(xlabel="probability it gives to people's\nanswer (geometric mean, %)", xlim=(0, 100))
    panels[1].set(xlabel="Cohen's κ of its answers\nwith people's", xlim=(min(-0.1, panels[1].get_xlim()[0]), 1.02))
    panels[2].set(
        xlabel="information shared with people's\nanswers (bits, beyond chance)", xlim=(0, 1.05 * math.log2(answers))
    )
    grey = " (bars: each subject)" if (table.groupby("observer").size() > 2).any() else ""
    figure.suptitle(f"How well observers say what people answered{grey}", fontweight="bold", fontsize=10)
    return figure


def _corrected(lines: Any, name: str) -> Any:
    """What is said, and of information what chance alone makes of so few trials taken away."""
    return np.maximum(lines["bits"] - lines["bits_of_chance"], 0.0) if name == "bits" else lines[name]


def decisions(table: pd.DataFrame, matches: Sequence[Match], agreement: pd.DataFrame) -> Figure:
    """Draw when observers are sure against when people answer.

    Args:
        table: (M,) trials, with `response_time`.
        matches: of the observers that are shown.
        agreement: of `summaries.agreement`.

    Returns:
        A panel for each observer, a dot for each trial.
    """
    shown = list(matches)[:MOST_PANELS]
    colours = colours_of_observers([each.label for each in shown])
    figure = Figure(figsize=(min(WIDTH, 1.0 + 2.4 * max(len(shown), 1.3)), 3.0), layout="constrained")
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for axes, each in zip(panels, shown, strict=True):
        never = np.isinf(each.decided)
        latest = np.nanmax(np.where(never, np.nan, each.decided)) if (~never & each.known).any() else 1.0
        place = np.where(never, 1.2 * latest, each.decided)
        axes.plot(place, table["response_time"], ".", color=colours[each.label], alpha=0.35, markersize=5)
        row = agreement[agreement["observer"] == each.label].iloc[0]
        told = (
            ""
            if math.isnan(row["time_rho"])
            else f"\nρ = {row['time_rho']:.2f} [{row['time_rho_low']:.2f}, {row['time_rho_high']:.2f}]"
        )
        axes.set_title(f"{wrapped(each.label, 26)}{told}".replace("-0.00", "0.00").replace("-", "−"), fontsize=8.5)
        axes.set(xlabel="observer is sure after (s)", xlim=(0, 1.3 * latest), ylim=(0, None))
        if never.any():
            axes.axvline(1.1 * latest, color="#777777", linewidth=0.8, linestyle=":")
            axes.text(
                1.2 * latest, 1.0, "never", ha="center", va="top", fontsize=7.5, transform=axes.get_xaxis_transform()
            )
    panels[0].set_ylabel("people's response time (s)")
    figure.suptitle("When observers are sure, and when people answer", fontweight="bold", fontsize=10)
    return figure


def _interval(axes: Axes, value: float, low: float, high: float, row: float, colour: str) -> None:
    axes.plot([low, high], [row, row], color=colour, linewidth=1.8, solid_capstyle="butt", zorder=2)
    axes.plot(value, row, "o", color=colour, markersize=5, zorder=3)
