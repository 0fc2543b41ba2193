"""Which policy makes the observer know soonest: policies side by side, over the same objects and noises.

Where a trial ends undecided its time to decision is only known to be longer, so medians are compared, not means.
"""

from __future__ import annotations

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
from haptic_lab.analysis.statistics import FEW, bootstrapped, interval, median, told_of_trials
from haptic_lab.conditions import factors_in
from haptic_lab.files import write_table
from haptic_lab.style import OUTLINE, noise_colours
from observer import metrics

DECISION, ACCURACY, NAMED = "time_to_decision", "step_accuracy_5s", "correct_10s"
# Column of the table of trials: what it is called, and what is more of it.
COLUMNS = {
    DECISION: "time to decision, median (s)",
    ACCURACY: "right, average over the first 5 s",
    NAMED: "right after 10 s",
}

NOTHING = "no trial lasted so long"
LATER = "undecided ▸"
OPEN = 1.25  # an interval without an end is drawn so many times as far as the last one begins
AT_THE_RIGHT: Any = {"ha": "right", "va": "center", "fontsize": 8, "bbox": {"color": "white", "pad": 0.5}}
WORLD = ["shape", "seed"]
ESTIMATES = ["value", "low", "high", "trials", "decided"]


def compare(rows: pd.DataFrame) -> pd.DataFrame:
    """Compare policies, noise by noise.

    Time to decision: the median, trials that end undecided counted as longer than any, with the interval that order
    statistics give; infinite where it is after the end. Step-averaged accuracy: mean, Student's t. Right after 10 s:
    share, Wilson.

    Args:
        rows: of the table of trials.

    Returns:
        A line for each of the factors, observer and measure of `COLUMNS`: estimate (`value`), 95 % interval (`low`,
        `high`), `trials`, and the share that was `decided`.

    References:
        Conover 1999, Practical Nonparametric Statistics, section 3.2.
    """
    lines = []
    groups = [*factors_in(rows.columns), "observer"]
    for names, group in rows.groupby(groups, sort=False):
        times = group[DECISION].fillna(np.inf).to_numpy()
        decided = float(np.isfinite(times).mean())
        for measure, found in (
            (DECISION, median(times)),
            (ACCURACY, interval(group[ACCURACY].to_numpy())),
            (NAMED, metrics.accuracy(group[NAMED].dropna().to_numpy(dtype=np.float64))),
        ):
            lines.append((*names, measure, *found, decided))
    return pd.DataFrame(lines, columns=[*groups, "measure", *ESTIMATES])


def together(rows: pd.DataFrame) -> pd.DataFrame:
    """Compare policies over all noises at once, in the worlds (shape and seed) that were explored at each noise.

    Args:
        rows: of the table of trials.

    Returns:
        Lines as those of `compare`, `sigma_deg` being NaN; none where there is one noise. Intervals are percentiles of
        2000 bootstraps of the worlds.

    References:
        Efron & Tibshirani 1993, An Introduction to the Bootstrap, section 13.3.
    """
    groups = [name for name in (*factors_in(rows.columns), "observer") if name != "sigma_deg"]
    noises, lines = rows["sigma_deg"].nunique(), []
    for names, group in rows.groupby(groups, sort=False) if noises > 1 else ():
        whole = group.groupby(WORLD).filter(lambda world: len(world) == noises).sort_values(WORLD)
        if whole.empty:
            continue
        shape = -1, noises
        times = whole[DECISION].fillna(np.inf).to_numpy().reshape(shape)
        for measure, table, estimate in (
            (DECISION, times, np.median),
            (ACCURACY, whole[ACCURACY].to_numpy().reshape(shape), np.mean),
            (NAMED, whole[NAMED].to_numpy().reshape(shape), np.mean),
        ):
            found = bootstrapped(table, estimate)
            lines.append((*names, np.nan, measure, *found, table.size, float(np.isfinite(times).mean())))
    return pd.DataFrame(lines, columns=[*groups, "sigma_deg", "measure", *ESTIMATES])


def save(rows: pd.DataFrame, folder: Path) -> list[str]:
    """Write policies.csv and policies.png.

    Args:
        rows: of the table of trials.
        folder: to write to.

    Returns:
        The names of the files.
    """
    lines = compare(rows)
    return write_table(folder, "policies", pd.concat([lines, together(rows)]), draw(lines))


def print_table(path: Path, console: Console) -> None:
    """Print policies.csv: a row for each policy and noise, and for all noises together.

    Args:
        path: of the file that `save` has written.
        console: to print to.
    """
    lines = pd.read_csv(path)
    for observer, mine in lines.groupby("observer", sort=False):
        result = Table(
            title=f"Policies, judged by {observer}: best estimate and 95 % interval",
            title_justify="left",
            title_style="bold",
            box=box.SIMPLE_HEAD,
        )
        for name in ("σ", "policy", "trials", *COLUMNS.values(), "decided"):
            result.add_column(name, justify="left" if name == "policy" else "right")
        for sigma, of_sigma in mine.groupby("sigma_deg", dropna=False):
            for policy, cells in of_sigma.groupby("policy", sort=False):
                by = cells.set_index("measure")
                trials, decided = str(int(by["trials"].max())), f"{by['decided'].iloc[0]:.0%}"
                told = [_cell(by.loc[measure], measure) for measure in COLUMNS]
                result.add_row("all" if np.isnan(sigma) else f"{sigma:g}°", str(policy), trials, *told, decided)
            result.add_section()
        console.print(result)


def draw(lines: pd.DataFrame) -> Figure:
    """Draw the comparison, as the first observer judges it.

    Args:
        lines: what `compare` returns.

    Returns:
        A panel for each measure, a row for each policy, a colour for each noise.
    """
    mine = lines[lines["observer"] == lines["observer"].iloc[0]]
    policies = list(dict.fromkeys(mine["policy"]))
    noises = sorted(set(mine["sigma_deg"]))
    colours = noise_colours(noises)
    figure = Figure(figsize=(11, 1.6 + 0.45 * len(policies)), layout="constrained")
    panels = figure.subplots(1, len(COLUMNS), sharey=True)
    for axes, (measure, heading) in zip(panels, COLUMNS.items(), strict=True):
        for index, noise in enumerate(noises):
            cells = mine[(mine["measure"] == measure) & (mine["sigma_deg"] == noise)].set_index("policy")
            offset = 0.3 * ((index + 0.5) / len(noises) - 0.5)
            _draw_rows(axes, cells.reindex(policies), offset, colours[noise], f"σ = {noise:g}°")
        if mine.loc[mine["measure"] == measure, "value"].isna().all():
            axes.text(0.5, 0.5, NOTHING, transform=axes.transAxes, ha="center", va="center", color="#777777")
        axes.set_title(heading)
        axes.set_xlim(left=0)
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="x", color="#EEEEEE")
    for axes in panels[1:]:
        axes.set_xlim(0, 1.02)
    panels[0].set(yticks=range(len(policies)), yticklabels=[each.replace("_", " ") for each in policies])
    panels[0].invert_yaxis()
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    trials = int(mine["trials"].max())
    figure.suptitle(
        f"How soon is the object known? {validate.counted(trials, 'exploration')} a policy and noise, "
        f"{told_of_trials(trials)} (left: less is better)",
        fontsize=11,
        fontweight="bold",
    )
    return figure


def _draw_rows(axes: Axes, cells: pd.DataFrame, offset: float, colour: str, label: str) -> None:
    last = cells.loc[np.isfinite(cells["low"]), "low"].max()
    for place, (_, cell) in enumerate(cells.iterrows()):
        if cell["trials"] >= FEW and np.isfinite(cell["low"]):
            high = cell["high"] if np.isfinite(cell["high"]) else OPEN * last
            axes.plot([cell["low"], high], [place + offset] * 2, color=colour, linewidth=2)
        if np.isinf(cell["value"]):
            axes.text(0.99, place + offset, LATER, color=colour, transform=axes.get_yaxis_transform(), **AT_THE_RIGHT)
    axes.plot(cells["value"], np.arange(len(cells)) + offset, "o", color=colour, markersize=6, label=label)
    axes.axvline(0, color=OUTLINE, linewidth=1)


def _cell(line: pd.Series, measure: str) -> str:
    if np.isnan(line["value"]):
        return "–"
    if measure == DECISION:
        return " ".join((_seconds(line["value"]), f"[{_seconds(line['low'])}–{_seconds(line['high'])}]"))
    return f"{line['value']:.0%} [{100 * line['low']:.0f}–{100 * line['high']:.0f}]"


def _seconds(value: float) -> str:
    return f"{value:.1f}" if np.isfinite(value) else "later"
