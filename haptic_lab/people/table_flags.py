"""Flags of commands that take tables of people's trials."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from haptic_env import validate
from haptic_lab.people.trial_columns import TrialColumns, typed
from haptic_lab.people.trials import read_trials
from haptic_lab.terminal import as_path


def add_table_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags that say what the columns of a table are.

    Args:
        parser: of the command.
    """
    add = parser.add_argument
    several: dict[str, Any] = {"action": "extend", "nargs": "+", "default": []}
    add("--columns", type=as_path, metavar="MAP.toml", help="what columns, units and names mean (docs/people.md)")
    add(
        "--column", metavar="OURS=THEIRS", help="what the table calls a column, as in subject=participant_id", **several
    )
    add("--unit", metavar="OURS=UNIT", help="in which unit a column is: seconds=ms, confidence=percent", **several)
    add("--name", metavar="THEIRS=SHAPE", help="what the table calls an object or answer, as in ball=sphere", **several)
    add("--free-names", action="store_true", help="objects and answers need not be shapes, and are taken as they are")


def read_tables(paths: Sequence[str], given: argparse.Namespace) -> pd.DataFrame:
    """Read the tables of a command line, one after the other.

    Args:
        paths: of the files.
        given: the values of the flags of `add_table_flags`.

    Returns:
        All trials.

    Raises:
        ValueError: for what `read_trials` refuses, and a trial that is in two of them.
        OSError: where one cannot be read.
    """
    meaning = typed(given.columns, given.column, given.unit, given.name)
    return together([(str(path), _read(path, meaning, given.free_names)) for path in paths])


def together(tables: Sequence[tuple[str, pd.DataFrame]]) -> pd.DataFrame:
    """Put tables one below the other.

    Args:
        tables: their names and trials.

    Returns:
        All trials. Where each table counts those of a subject from 1, they are counted through all of them.

    Raises:
        ValueError: for a trial that is in two of them.
    """
    if len(tables) == 1:
        return tables[0][1]
    table = pd.concat([each for _, each in tables], ignore_index=True)
    for name in ("condition", "recording"):
        if name in table:
            table[name] = table[name].fillna("")
    twice = table.duplicated(["subject", "trial"])
    if twice.any():
        counted = all((each["trial"] == each.groupby("subject").cumcount() + 1).all() for _, each in tables)
        if not counted:
            first = table[twice].iloc[0]
            told = validate.listed(name for name, _ in tables)
            raise ValueError(
                f"trial {first['trial']} of subject {validate.shown(first['subject'])} is in two of {told}"
            )
        table["trial"] = table.groupby("subject").cumcount() + 1
    return table


def _read(path: str, meaning: TrialColumns, free_names: bool) -> pd.DataFrame:
    return read_trials(Path(path), meaning, free_names=free_names)
