"""The table of a sweep: appended trial by trial, whole or not at all, and never of two configurations.

A folder holds config.json, trials.csv (one row for each trial and observer; `pandas.read_csv` opens it) and the
maps of the exemplars. Killed at any moment it loses the trials under way and nothing else.
"""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from conditions import FACTORS
from files import atomic, write_json

Row = dict[str, str]
Key = tuple[float | str, ...]  # of a trial: `KEY` but for the observer
KEY = (*FACTORS, "shape", "seed", "observer")


class Results:
    """The rows of a sweep in `folder`, each as the text that stands in the file, so that resuming changes no bit."""

    def __init__(
        self,
        folder: Path,
        config: Mapping[str, Any],
        columns: Sequence[str],
        numbers: Sequence[str],
        order: Sequence[str],
    ) -> None:
        """`columns` of the table, of which `numbers` hold numbers (or nothing); `order`: a trial's observers.

        Raises `ValueError` for a folder that holds another configuration, or a table that is corrupt.
        """
        self.folder, self.columns, self.numbers, self.order = folder, list(columns), set(numbers), list(order)
        self.path = folder / "trials.csv"
        self._check_config(config)
        self.trials: dict[Key, list[Row]] = {}
        if self.path.exists():
            if self._read():
                self.rewrite()
        else:
            self.rewrite()

    def append(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Add the rows of one finished trial, in one write that reaches the disk."""
        text = [{name: _text(row[name]) for name in self.columns} for row in rows]
        self.trials[self._key(text[0])] = text
        with self.path.open("ab") as file:
            file.write(self._lines(text).encode())
            file.flush()
            os.fsync(file.fileno())

    def rewrite(self) -> None:
        """The same table in the order of `KEY`, whatever the order in which trials finished."""
        rows = [row for key in sorted(self.trials) for row in self.trials[key]]
        with atomic(self.path) as place:
            place.write_text(self._lines([dict(zip(self.columns, self.columns, strict=True)), *rows]))

    def _key(self, row: Row) -> Key:
        return tuple(float(row[name]) if name in self.numbers else row[name] for name in KEY[:-1])

    def _lines(self, rows: Sequence[Row]) -> str:
        text = io.StringIO()
        csv.DictWriter(text, self.columns, lineterminator="\n").writerows(rows)
        return text.getvalue()

    def _check_config(self, config: Mapping[str, Any]) -> None:
        path = self.folder / "config.json"
        if not path.exists():
            if self.path.exists():
                raise ValueError(f"{self.path} has no config.json beside it, so nobody knows what it holds")
            write_json(path, config)
            return
        try:
            there = json.loads(path.read_text())
        except ValueError as error:
            raise ValueError(f"{path} is corrupt ({error}); choose another --out or delete {self.folder}") from error
        here = json.loads(json.dumps(config))
        if not isinstance(there, dict):
            raise ValueError(f"{path} is corrupt (no settings in it); choose another --out or delete {self.folder}")
        names = [name for name in {**there, **here} if there.get(name) != here.get(name)]
        if names:
            told = "; ".join(
                f"{name} is {_short(there.get(name))} there and {_short(here.get(name))} here" for name in names
            )
            raise ValueError(f"{self.folder} holds another configuration: {told}; choose another --out")

    def _read(self) -> bool:
        """Read the table; whether a half-written end was dropped."""
        try:
            text = self.path.read_bytes().decode()
        except UnicodeDecodeError as error:
            raise ValueError(f"{self.path} is corrupt: {error}") from error
        lines = text.split("\n")
        torn = lines.pop() != ""  # what follows the last newline: a line that was being written
        if not lines or next(csv.reader(lines[:1]), []) != self.columns:
            raise ValueError(f"{self.path}, line 1: the columns are not those of this table; choose another --out")
        for number, fields in enumerate(csv.reader(lines[1:]), start=2):
            row = self._checked(number, fields)
            self.trials.setdefault(self._key(row), []).append(row)
        for key, rows in list(self.trials.items()):
            observers = [row["observer"] for row in rows]
            if observers == self.order:
                continue
            if key != list(self.trials)[-1] or observers != self.order[: len(observers)]:
                raise ValueError(f"{self.path} is corrupt: the trial {key} has rows of {', '.join(observers)}")
            del self.trials[key]  # the last one, cut off between two of its rows
            torn = True
        return torn

    def _checked(self, number: int, fields: list[str]) -> Row:
        if len(fields) != len(self.columns):
            raise ValueError(
                f"{self.path}, line {number}: {len(fields)} fields, not {len(self.columns)}; the table is corrupt"
            )
        row = dict(zip(self.columns, fields, strict=True))
        for name in self.numbers:
            try:
                float(row[name] or "nan")
            except ValueError:
                raise ValueError(
                    f"{self.path}, line {number}: {name} must be a number, got {row[name]!r}; the table is corrupt"
                ) from None
        return row


def _text(value: Any) -> str:
    """As it stands in the table: floats so that they read back the same, NaN as an empty field."""
    if isinstance(value, float):
        return "" if value != value else repr(float(value))
    return str(value)


def _short(value: Any) -> str:
    return "absent" if value is None else json.dumps(value)
