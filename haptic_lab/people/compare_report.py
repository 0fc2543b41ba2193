"""What is told of models beside each other: tables and pictures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from haptic_lab.style import BETTER, OUTLINE, as_drawn

FILES = ("compare.csv", "compare.png", "recovery.csv")


def tell(table: pd.DataFrame, console: Console) -> None:
    """Print which model explains whom.

    Args:
        table: rows of `Comparison.table`, with `subject`.
        console: to print on.
    """
    shown = Table(title="Log likelihood of an answer that was not told, nats a trial", title_justify="left")
    for head in ("subject", "model", "log likelihood", "below the best by", "95 % interval", "trials"):
        shown.add_column(head)
    for row in table.itertuples():
        best = row.difference == 0.0
        unknown = best or math.isnan(row.difference_low)
        ends = "" if unknown else f"{-row.difference_high:.4f} to {-row.difference_low:.4f}"
        below = "" if best else f"{-row.difference:.4f}"
        shown.add_row(row.subject, row.model, f"{row.nats:.4f}", below, ends, str(row.trials))
    console.print(shown)


def tell_recovery(table: pd.DataFrame, trials: int, console: Console) -> None:
    """Print which models are found where another is true.

    Args:
        table: of `recovery_table`.
        trials: of each subject.
        console: to print on.
    """
    names = list(dict.fromkeys(table["true"]))
    shown = Table(title=f"Simulated subjects of {trials} trials: found, where a row is true", title_justify="left")
    for head in ("true", *names, "95 % interval of right"):
        shown.add_column(head)
    for name in names:
        mine = table[table["true"] == name].set_index("best")
        right = mine.loc[name]
        shares = (f"{mine.loc[each, 'share']:.0%}" for each in names)
        shown.add_row(name, *shares, f"{right['low']:.0%} to {right['high']:.0%}")
    console.print(shown)


def picture(table: pd.DataFrame, recovery: pd.DataFrame | None) -> Figure:
    """Draw how far each model is below the best, and what is found of simulated subjects.

    Args:
        table: rows of `Comparison.table`, with `subject`.
        recovery: of `recovery_table`; None: nobody was simulated.

    Returns:
        The figure.
    """
    subjects, models = list(dict.fromkeys(table["subject"])), sorted(set(table["model"]))
    panels = 1 if recovery is None else 2
    height = 1.2 + 0.22 * max(len(subjects) * (len(models) + 1), 8)
    figure = Figure(figsize=(4.6 * panels, min(height, 12.0)), layout="constrained")
    axis, *beside = figure.subplots(1, panels, squeeze=False)[0]
    labels: list[str] = []
    for subject in subjects:
        mine = table[table["subject"] == subject]
        for row in mine.itertuples():
            place = len(labels)
            ends = [[row.difference - row.difference_low], [row.difference_high - row.difference]]
            colour = BETTER if row.difference == 0.0 else OUTLINE
            axis.errorbar([row.difference], [place], xerr=ends, fmt="o", ms=4, lw=1.2, color=colour)
            labels.append(f"{as_drawn(subject)}: {as_drawn(row.model)}")
    axis.axvline(0.0, color="#999999", lw=0.8)
    axis.set_yticks(range(len(labels)), labels, fontsize=7 if len(labels) <= 40 else 4)
    axis.invert_yaxis()
    axis.locator_params(axis="x", nbins=5)
    axis.set(xlabel="difference from the best (nats a trial)", title="Who explains the answers (95 % intervals)")
    if recovery is not None:
        _draw_recovery(beside[0], recovery)
    return figure


def _draw_recovery(axis: Any, recovery: pd.DataFrame) -> None:
    names = list(dict.fromkeys(recovery["true"]))
    shares = recovery["share"].to_numpy().reshape(len(names), len(names))
    axis.imshow(shares, vmin=0.0, vmax=1.0, cmap="Blues")
    for (row, column), share in np.ndenumerate(shares):
        axis.text(column, row, f"{share:.0%}", ha="center", va="center", color="white" if share > 0.6 else "black")
    titles = [as_drawn(name) for name in names]
    axis.set_xticks(range(len(names)), titles, rotation=45, ha="right")
    axis.set_yticks(range(len(names)), titles)
    axis.set(xlabel="found", ylabel="true", title="Who is found of simulated subjects")


def design_picture(table: pd.DataFrame, powers: list[float], names: list[str]) -> Figure:
    """Draw the power against the number of trials.

    Args:
        table: of `Design.table`.
        powers: that are asked for.
        names: of the two models.

    Returns:
        The figure.
    """
    figure = Figure(figsize=(4.6, 3.4), layout="constrained")
    axis = figure.subplots()
    axis.fill_between(table["trials"], table["low"], table["high"], color=BETTER, alpha=0.2, lw=0)
    axis.plot(table["trials"], table["power"], "o-", ms=3, color=BETTER)
    for power in powers:
        axis.axhline(power, color="#999999", lw=0.8, ls="--", label="power asked for" if power == powers[0] else None)
    axis.set_xscale("log")
    ticks = [tick for tick in (10, 20, 50, 100, 200, 500, 1000, 2000, 5000) if tick <= table["trials"].max()]
    axis.set_xticks(ticks, [str(tick) for tick in ticks])
    axis.xaxis.minorticks_off()
    told = f"{as_drawn(names[0])} told from {as_drawn(names[1])} (95 % interval)"
    axis.set(xlabel="trials of a subject", ylabel="share told rightly", ylim=(0.0, 1.02), title=told)
    axis.legend(fontsize=7, loc="lower right")
    return figure
