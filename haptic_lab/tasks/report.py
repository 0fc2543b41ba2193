"""The benchmark's table, page and picture: each measure with a 95 % interval over worlds.

An exploration that ends undecided counts as later than any.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from haptic_lab.analysis.statistics import bootstrapped
from haptic_lab.learning.presets import NAME
from haptic_lab.style import BETTER, OUTLINE, as_drawn
from haptic_lab.tasks.judging import ACCURACY, COVERED, DECISION, RIGHT, measured
from haptic_lab.tasks.learners import END_TO_END, LEARNERS
from haptic_lab.tasks.registry import TASKS
from haptic_lab.tasks.worlds import evaluation_set

TITLES = {
    DECISION: "median decision time",
    ACCURACY: "step-averaged accuracy over 5 s",
    RIGHT: "right at the end",
    COVERED: "surface covered after 20 s",
}
LEAST = 2  # worlds, for an interval


def table_of(rows: pd.DataFrame) -> pd.DataFrame:
    """Make the table.

    Args:
        rows: of `haptic_lab.tasks.benchmark.run`.

    Returns:
        A line for each task, policy and measure: `measure` (`TITLES`), `value`, `low`, `high`, `worlds`, and the share
        that was `decided`.
    """
    lines = []
    for (task, policy), mine in rows.groupby(["task", "policy"], sort=False):
        decided = float(mine[DECISION].notna().mean()) if TASKS[str(task)].task == NAME else np.nan
        for measure in measured(TASKS[str(task)]):
            values = mine[measure].fillna(np.inf).to_numpy(dtype=np.float64)[:, None]
            estimate = np.median if measure == DECISION else np.mean
            value, low, high = float(estimate(values)), np.nan, np.nan
            if len(values) >= LEAST:
                with np.errstate(invalid="ignore"):  # of decisions that were not taken
                    value, low, high = bootstrapped(values, estimate)
            lines.append((task, policy, TITLES[measure], value, low, high, len(values), decided))
    order = {name: index for index, name in enumerate(TASKS)}
    columns = ["task", "policy", "measure", "value", "low", "high", "worlds", "decided"]
    table = pd.DataFrame(lines, columns=columns)
    return table.sort_values("task", key=lambda tasks: tasks.map(order), kind="stable", ignore_index=True)


def page(table: pd.DataFrame, command: str, steps: int, left: dict[tuple[str, str], str]) -> str:
    """Write the page.

    Args:
        table: of `table_of`.
        command: that has made it.
        steps: of the environment that learners have learnt from.
        left: why policies were left out of tasks.

    Returns:
        Markdown.
    """
    lines = ["# Policies × tasks", "", f"    {command}", ""]
    lines.append("95 % intervals: percentiles of 2000 bootstraps of the worlds. Undecided counts as later than any.")
    for task, mine in table.groupby("task", sort=False):
        worlds = evaluation_set(str(task))
        measures = list(dict.fromkeys(mine["measure"]))
        noises = " and ".join(f"{sigma:g}°" for sigma in worlds.sigmas_deg)
        seeds = f"seeds from {worlds.first_seed}"
        named = TASKS[str(task)].task == NAME
        lines += [
            "",
            f"## HapticSLAM/{task}-v0",
            "",
            f"Worlds of version {worlds.version}, {seeds}, σ = {noises} in turn.",
        ]
        heads = ["policy", "steps learnt", "worlds", *measures, *(["decided"] if named else [])]
        lines += ["", f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
        for policy, cells in mine.groupby("policy", sort=False):
            by = cells.set_index("measure")
            learnt = f"{steps}" if policy in LEARNERS else "–"
            shown = [f"`{policy}`", learnt, str(int(by["worlds"].iloc[0]))]
            shown += [cell(by.loc[measure], measure) for measure in measures]
            lines.append(f"| {' | '.join([*shown, *([f'{by.decided.iloc[0]:.0%}'] if named else [])])} |")
        lines += [f"\n`{policy}` is left out: {why}" for (other, policy), why in left.items() if other == task]
    used = [name for name in LEARNERS if name in set(table["policy"])]
    if used:
        lines += ["", "Learners:", "", *(f"- `{name}`: {LEARNERS[name]}" for name in used)]
    if set(used) & set(END_TO_END):
        lines += ["", "Learners without an observer are judged by their own guesses, all others by one observer's."]
    return "\n".join(lines) + "\n"


def cell(line: pd.Series, measure: str) -> str:
    """Write a figure with its interval.

    Args:
        line: of the table.
        measure: that it is of.

    Returns:
        The text.
    """

    def said(value: float) -> str:
        if measure != TITLES[DECISION]:
            return f"{100 * value:.0f}"
        return f"{value:.1f}" if np.isfinite(value) else "later"

    unit = (" s" if np.isfinite(line["value"]) else "") if measure == TITLES[DECISION] else " %"
    interval = "" if np.isnan(line["low"]) else f" [{said(line['low'])}–{said(line['high'])}]"
    return f"{said(line['value'])}{unit}{interval}"


def draw(table: pd.DataFrame) -> Figure:
    """Draw the table.

    Args:
        table: of `table_of`.

    Returns:
        A panel for each task and measure, a row for each policy.
    """
    panels = [
        (task, measure)
        for task, mine in table.groupby("task", sort=False)
        for measure in dict.fromkeys(mine["measure"])
        if measure != TITLES[RIGHT]
    ]
    policies = list(dict.fromkeys(table["policy"]))
    figure = Figure(figsize=(3.2 * len(panels) + 1.5, 1.4 + 0.32 * len(policies)), layout="constrained")
    rows = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (task, measure) in zip(rows, panels, strict=True):
        mine = table[(table["task"] == task) & (table["measure"] == measure)].set_index("policy").reindex(policies)
        finite = mine[["value", "low", "high"]].to_numpy(dtype=np.float64)
        top = 1.0 if measure != TITLES[DECISION] else max(1.0, float(np.max(finite[np.isfinite(finite)], initial=0.0)))
        for row, (value, low, high) in enumerate(finite):
            if np.isfinite(low):
                axes.plot([low, min(high, 1.1 * top)], [row, row], color=BETTER, linewidth=2)
            if np.isfinite(value):
                axes.plot(value, row, "o", color=BETTER, markersize=5)
        unit = " (s)" if measure == TITLES[DECISION] else ""
        axes.set_title(f"{task}\n{measure}{unit}", fontsize=10)
        axes.set_xlim(0, 1.05 * top)
        axes.axvline(0, color=OUTLINE, linewidth=1)
        axes.grid(axis="x", color="#EEEEEE")
    rows[0].set(yticks=range(len(policies)), yticklabels=[as_drawn(each.replace("_", " ")) for each in policies])
    rows[0].invert_yaxis()
    return figure
