"""Sweeps that a table of people's trials drives: what they explored is explored again by the observers."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd

from haptic_env import validate
from haptic_env.shapes.names import NONE
from haptic_lab.conditions import Condition
from haptic_lab.people import trial_columns
from haptic_lab.people.trial_checks import WORDS
from haptic_lab.people.trials import read_trials
from haptic_lab.possible import DOUBT
from haptic_lab.terminal import as_path
from haptic_lab.worlds import as_shape

SAID = {"shapes": "--shapes", "objects": "--objects", "recordings": "--recordings"}  # which the table says
FLAGS = {name: f"--{name}" for name in ("columns", "column", "unit", "name", "under", "standard")}


class Cell(NamedTuple):
    """What some trials of a table have in common.

    Attributes:
        condition: as the table calls it; "" where it has none.
        object: name of a shape.
        seconds: s, that were explored.
        recording: path of the subject's own; "": none.
    """

    condition: str
    object: str
    seconds: float
    recording: str


def add_flags(add: Callable[..., Any]) -> None:
    """Let a command take a table of trials.

    Args:
        add: adds an argument to its parser.
    """
    add(
        "--trial-table",
        type=as_path,
        metavar="TABLE",
        help="explore again what people did, by their trials in a .csv or .tsv (docs/people.md): each object, "
        "condition and time, or each recording of theirs",
    )
    add("--columns", type=as_path, metavar="FILE", help="TOML that says what the columns of that table are")
    add("--column", nargs="+", metavar="OURS=THEIRS", help="or what the table calls a column: seconds=duration")
    add("--unit", nargs="+", metavar="OURS=UNIT", help="or its unit: seconds=ms")
    add("--name", nargs="+", metavar="THEIRS=SHAPE", help="or an object or response: ball=sphere")
    add("--under", nargs="+", metavar="CONDITION", help="only trials of these conditions (default all)")
    told = "of choices of two intervals: what the other one had, to be explored as well (docs/people.md)"
    add("--standard", type=as_shape, metavar="SHAPE", help=told)


def read(given: argparse.Namespace) -> pd.DataFrame | None:
    """Read the table, as far as it is asked for.

    Args:
        given: all options.

    Returns:
        (M,) trials; None: there is no table.

    Raises:
        ValueError: for a table that is none, and for options that do not go with it.
    """
    if given.trial_table is None:
        useless = [flag for name, flag in FLAGS.items() if getattr(given, name) is not None]
        if useless:
            raise ValueError(f"{useless[0]} is for --trial-table, which is not given")
        return None
    for name, flag in SAID.items():
        if getattr(given, name) is not None:
            raise ValueError(f"--trial-table says what is explored, and so does {flag}: say one of them")
    told = [list(getattr(given, name) or ()) for name in ("column", "unit", "name")]
    table = read_trials(given.trial_table, trial_columns.typed(given.columns, *told))
    if given.under is None:
        return table
    if "condition" not in table:
        raise ValueError(f"--under is for tables with a column condition, and {given.trial_table} has none")
    there = [*dict.fromkeys(table["condition"])]
    for name in given.under:
        validate.choice(f"condition of {given.trial_table}", name, there)
    return table[table["condition"].isin(given.under)]


def cells_of(given: argparse.Namespace, table: pd.DataFrame) -> list[Cell]:
    """List what is to be explored.

    Args:
        given: all options.
        table: (M,) trials.

    Returns:
        Each combination once, in the order of the table; with `courses` the longest time alone of each.

    Raises:
        ValueError: for trials that cannot be explored together.
    """
    found = dict.fromkeys(_cells(table))
    if given.standard is not None:
        found |= dict.fromkeys(each._replace(object=given.standard, recording="") for each in found)
    if given.courses:  # a course of the longest has the others in it
        longest: dict[tuple[str, str, str], Cell] = {}
        for each in found:
            alike = each.condition, each.object, each.recording
            if alike not in longest or longest[alike].seconds < each.seconds:
                longest[alike] = each
        found = dict.fromkeys(longest.values())
    if given.seconds is not None:
        found = dict.fromkeys(each._replace(seconds=seconds) for each in found for seconds in given.seconds)
    recorded = [each for each in found if each.recording]
    if recorded and len(recorded) < len(found):
        other = next(each for each in found if not each.recording)
        raise ValueError(
            f"{given.trial_table}: some trials have a recording, and others none, such as those of {other.object!r} "
            f"under {other.condition!r}; explore them apart, with --under"
        )
    return list(found)


def as_flags(given: argparse.Namespace, table: pd.DataFrame, cells: Sequence[Cell]) -> argparse.Namespace:
    """Say by flags what a table says.

    Args:
        given: all options.
        table: (M,) trials.
        cells: of its table.

    Returns:
        The options, with what is explored, and what it may be where nothing else is said.

    Raises:
        ValueError: for a recording that is of several objects.
    """
    told: dict[str, Any] = {"shapes": list(dict.fromkeys(each.object for each in cells))}
    answers = {*table["response"]}
    if given.candidates is None:
        told["candidates"] = list(dict.fromkeys([*told["shapes"], *map(as_shape, sorted(answers - {*WORDS}))]))
    if given.none is None and NONE in answers:
        told["none"] = DOUBT
    recordings: dict[str, str] = {}
    for each in cells:
        if each.recording and recordings.setdefault(each.recording, each.object) != each.object:
            several = f"{recordings[each.recording]!r} and {each.object!r}"
            raise ValueError(f"{given.trial_table}: the recording {each.recording} is of {several}, and can be of one")
    if recordings:
        told |= {"recordings": list(recordings), "shapes": list(recordings.values())}
    return argparse.Namespace(**{**vars(given), "seconds": None, **told})


def conditions_of(conditions: Iterable[Condition], cells: Sequence[Cell]) -> Mapping[Condition, tuple[str, ...]]:
    """Say what is explored under which conditions.

    Args:
        conditions: what flags say of noise and policy, each with its recording, and that one's length, if any.
        cells: of the table.

    Returns:
        Names of shapes.
    """
    explored: dict[Condition, dict[str, None]] = {}
    for condition in conditions:
        for cell in cells:
            if cell.recording != condition.recording:
                continue
            seconds = min(cell.seconds, condition.seconds) if cell.recording else cell.seconds
            under = replace(condition, seconds=seconds, condition=cell.condition)
            explored.setdefault(under, {})[cell.object] = None
    return {condition: tuple(objects) for condition, objects in explored.items()}


def _cells(table: pd.DataFrame) -> list[Cell]:
    nothing = pd.Series("", index=table.index)
    texts = (table.get(name, nothing) for name in ("condition", "object", "recording"))
    return [
        Cell(condition, as_shape(name), float(seconds), recording)
        for condition, name, recording, seconds in zip(*texts, table["seconds"], strict=True)
    ]
