"""Answers against a stimulus that varies: their shares at each level, and the psychometric functions of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from haptic_env import validate
from haptic_lab.analysis.statistics import share_interval
from haptic_lab.people.psychometric import LEAST_LEVELS, Psychometric, fit_psychometric, level_of
from haptic_lab.people.scoring import YES, Design
from haptic_lab.people.summaries import Group, worth

ESTIMATES = ("threshold", "slope", "lapse", "guess")


def levels_of(table: pd.DataFrame, column: str | None = None, standard: str = "") -> tuple[str, Mapping[str, float]]:
    """Say which level of the stimulus each object is.

    Args:
        table: (M,) trials.
        column: of the table that has it; None: the one parameter that varies among the objects.
        standard: what they are compared with, of which the level may be known too; "": nothing.

    Returns:
        What varies, and its value for each object.

    Raises:
        ValueError: where there is no such column, or an object has several levels, or none, and where objects are
            compared with a standard between them, so that answers are right at both ends.
    """
    if column is None:
        what, levels = level_of(list(table["object"]))
        if len(set(levels.values())) < LEAST_LEVELS:
            raise ValueError(f"{what} has {len(set(levels.values()))} levels, and a threshold needs {LEAST_LEVELS}")
        _check_sides(what, levels, standard)
        return what, levels
    validate.choice("column of levels", column, [str(each) for each in table.columns])
    values = table[column]
    if not pd.api.types.is_numeric_dtype(values) or values.isna().any():
        raise ValueError(f"column {column!r} of levels must be a number in every trial")
    told = values.astype(np.float64).groupby(table["object"]).agg(["min", "max"])
    wrong = told.index[told["min"] != told["max"]]
    if len(wrong):
        low, high = told.loc[wrong[0]]
        raise ValueError(
            f"column {column!r} of levels must be one for each object, got {low:g} and {high:g} of {wrong[0]!r}"
        )
    return column, {str(name): float(level) for name, level in told["min"].items()}


def _check_sides(what: str, levels: Mapping[str, float], standard: str) -> None:
    try:
        middle = level_of([*levels, standard])[1][standard] if standard else -np.inf
    except ValueError:  # it differs in more than this, and has no level
        return
    if min(levels.values()) < middle < max(levels.values()):
        raise ValueError(
            f"{what} is below that of the standard, {middle:g}, in some objects and above it in others, so that it is "
            "no threshold's; report the two apart, or have a column with the distance from it"
        )


def shares(groups: Sequence[Group], levels: Mapping[str, float]) -> pd.DataFrame:
    """Count answers at each level.

    Args:
        groups: whose.
        levels: of `levels_of`.

    Returns:
        A line for each `who`, condition and level: the `share` of "yes" with Wilson's interval, of `trials`.
    """
    lines = []
    for who, kind, answers in groups:
        told = answers.assign(level=answers["object"].map(levels), yes=(answers["response"] == YES).astype(np.float64))
        for (condition, level), mine in told.groupby(["condition", "level"], sort=True):
            share = float(np.average(mine["yes"], weights=mine["weight"]))
            count, trials = worth(mine, mine["yes"])
            lines.append((who, kind, condition, level, share, *share_interval(count, trials), trials))
    return pd.DataFrame(lines, columns=["who", "kind", "condition", "level", "share", "low", "high", "trials"])


def fits(
    counted: pd.DataFrame, design: Design
) -> tuple[pd.DataFrame, dict[tuple[str, str, str], Psychometric], list[str]]:
    """Fit a psychometric function to each.

    Args:
        counted: of `shares`.
        design: what was asked.

    Returns:
        A line for each `who` and condition: threshold, slope, lapse and guess rate with their intervals; the functions
        by kind, `who` and condition; and whose could not be fitted, and why.

    Raises:
        ImportError: where psignifit is missing.
    """
    lines, found, refused = [], {}, []
    for (kind, who, condition), mine in counted.groupby(["kind", "who", "condition"], sort=False):
        trials = mine["trials"].to_numpy(dtype=np.float64)
        yes = np.round(mine["share"].to_numpy() * trials)
        try:
            function = fit_psychometric(mine["level"], yes, trials, 2 if design.kind == "2afc" else None)
        except ValueError as error:
            refused.append(f"{who}{f' ({condition})' if condition else ''}: {error}")
            continue
        found[(str(kind), str(who), str(condition))] = function
        lines.append(
            (who, kind, condition, *(end for name in ESTIMATES for end in getattr(function, name)), int(trials.sum()))
        )
    names = [f"{name}{end}" for name in ESTIMATES for end in ("", "_low", "_high")]
    return pd.DataFrame(lines, columns=["who", "kind", "condition", *names, "trials"]), found, refused
