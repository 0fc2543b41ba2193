"""Observers against the floor, cell by cell: differences in the same explorations, and closures, with intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.table import Table

from haptic_lab.analysis.statistics import interval, side
from haptic_lab.analysis.summary import ALL, CEILING, FLOOR, TITLES
from haptic_lab.conditions import factors_in
from haptic_lab.style import OBSERVER_NAMES
from observer import metrics

# Parts of the names of measures of which less is better, or more.
LESS = ("pose_error", "_ece", "_brier", "_log_loss", "time_to_decision", "mesh_chamfer")
MORE = ("f_score", "precision", "recall", "surface_coverage", "step_accuracy", "correct", "mesh_iou", "mesh_normal")
VERDICTS = {1: "better", 0: "undecided", -1: "worse"}  # by the side of 0, and which way is better
RESAMPLES = 2000
HALVES = (0.025, 0.975)


def direction(measure: str) -> int:
    """Tell which way a measure is better.

    Args:
        measure: column of the table of trials.

    Returns:
        1 where more of it is better, -1 where less is, 0 where neither is.
    """
    if any(part in measure for part in LESS):
        return -1
    return 1 if any(part in measure for part in MORE) else 0


def compare(rows: pd.DataFrame, measures: Sequence[str]) -> pd.DataFrame:
    """Hold each observer against the floor, in the explorations that both have.

    Args:
        rows: of the table of trials.
        measures: columns of it; those that are better neither way are left out.

    Returns:
        A line for each of the factors, shape (and `ALL`), observer and measure: means of `floor` and of the `observer`,
        their `difference` with its 95 % interval (`low`, `high`; Student's t, exploration by exploration), a `verdict`
        (which way that interval lies of 0), number of `trials`, and where the ceiling surely differs the `closure` with
        its interval (`closure_low`, `closure_high`; a bootstrap over explorations). An exploration that ends without a
        decision counts as decided at its end. Nothing without a floor and another.
    """
    told = [name for name in measures if name in rows and direction(name)]
    factors = factors_in(rows.columns)
    columns = [*factors, "shape", "observer", "measure", FLOOR, "mean", "difference", "low", "high", "verdict"]
    columns += ["trials", "closure", "closure_low", "closure_high"]
    decided = rows["time_to_decision"].fillna(rows["seconds"])
    rows = rows.assign(time_to_decision=decided, world=rows["shape"] + " " + rows["seed"].astype(str))
    lines = []
    for names, cell in pd.concat([rows, rows.assign(shape=ALL)]).groupby([*factors, "shape"], sort=False):
        worlds = cell.set_index("world")
        each = {str(name): mine[told].astype(float) for name, mine in worlds.groupby("observer", sort=False)}
        if FLOOR not in each:
            continue
        floor, ceiling = each.pop(FLOOR), each.get(CEILING)
        for observer, mine in each.items():
            gaps = mine - floor
            of_closure = _closures(floor, mine, ceiling) if ceiling is not None and observer != CEILING else None
            for column, measure in enumerate(told):
                difference, low, high, count = interval(gaps[measure].dropna().to_numpy())
                closure = (math.nan,) * 3 if of_closure is None else of_closure[:, column]
                means = floor[measure].mean(), mine[measure].mean()
                verdict = VERDICTS[side(low, high) * direction(measure)]
                lines.append((*names, observer, measure, *means, difference, low, high, verdict, count, *closure))
    return pd.DataFrame(lines, columns=columns)


def print_table(lines: pd.DataFrame, console: Console) -> None:
    """Print in how many cells, a shape and its factors each, an observer is better than the floor, or worse, by the
    measures of `TITLES`.

    Args:
        lines: what `compare` returns.
        console: to print to.
    """
    told = lines["measure"].isin(TITLES) & lines["low"].notna()
    cells = lines[told & (lines["shape"] != ALL) & (lines["observer"] != CEILING)]
    if cells.empty:
        return
    title = "Against raw angles (floor) in the same explorations, 95 %: cells of one shape and noise"
    result = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    for name in ("observer", "measure", *VERDICTS.values()):
        result.add_column(name, justify="left" if name in ("observer", "measure") else "right")
    for (observer, measure), mine in cells.groupby(["observer", "measure"], sort=False):
        counts = (str((mine["verdict"] == each).sum()) for each in VERDICTS.values())
        result.add_row(OBSERVER_NAMES.get(str(observer), str(observer)), str(measure), *counts)
    console.print(result)


def _closures(floor: pd.DataFrame, mine: pd.DataFrame, ceiling: pd.DataFrame) -> NDArray[np.float64]:
    """(3, M) the closure of M measures and the ends of its interval, by resampling the N explorations that all have."""
    shared = floor.index.intersection(mine.index).intersection(ceiling.index)
    tables = [each.loc[shared].to_numpy() for each in (mine, floor, ceiling)]
    tables = [np.where(np.isnan(sum(tables)), np.nan, each) for each in tables]
    rng, count = np.random.default_rng(0), len(shared)
    times = np.vstack([np.ones(count), rng.multinomial(count, np.full(count, 1 / count), RESAMPLES)])  # how often each
    held = ~np.isnan(tables[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        means = [times @ np.where(held, each, 0.0) / (times @ held) for each in tables]
        drawn = (means[0] - means[1]) / (means[2] - means[1])
    result = np.full((3, len(floor.columns)), np.nan)
    for column in range(result.shape[1]):
        bracket = (tables[2] - tables[1])[held[:, column], column]
        if not side(*interval(bracket)[1:3]):
            continue  # what lies between two that are the same
        result[0, column] = metrics.closure(*(float(each[0, column]) for each in means))
        if np.isfinite(drawn[:, column]).all():
            result[1:, column] = np.quantile(drawn[1:, column], HALVES)
    return result
