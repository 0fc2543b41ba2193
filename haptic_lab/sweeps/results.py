"""The table of a sweep: appended trial by trial, whole or not at all, and never of two configurations.

A folder holds config.json, trials.csv (one row for each trial and observer; `pandas.read_csv` opens it) and the
maps of the exemplars. Killed at any moment it loses the trials under way and nothing else. A row ends with a checksum
of its fields, so that one that was altered is no result any more.
"""

from __future__ import annotations

import csv
import io
import json
import os
import shlex
import zlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haptic_env.shapes.names import NONE
from haptic_lab.conditions import FACTORS, UNTOLD
from haptic_lab.faults import FAULTS
from haptic_lab.files import atomic, write_json, write_text

if TYPE_CHECKING:
    import pandas as pd

Row = dict[str, str]
Key = tuple[float | str, ...]  # of a trial: `KEY` but for the observer
KEY = (*FACTORS, "shape", "seed", "observer")
TEXTS = (*FAULTS, "policy", "recording", "condition", "shape", "observer")  # of `KEY`
USUAL = {name: str(value) if name in FAULTS else value for name, value in UNTOLD.items()}  # what no column tells
CHECK = "check"  # the last column
csv.field_size_limit(2**24)  # the course of an hour is longer than what `csv` takes for a field


def listed(names: Iterable[str]) -> str:
    """Put several names in one field.

    Args:
        names: any texts.

    Returns:
        The names with spaces, and quotes as the shell has them about what is more than a word.
    """
    return shlex.join(names)


def names_in(field: str) -> list[str]:
    """Read the names of a field.

    Args:
        field: of `listed`.

    Returns:
        The names.
    """
    return shlex.split(field) if "'" in field else field.split()


def labels_in(rows: pd.DataFrame) -> list[str]:
    """Say what objects could be called in a table.

    Args:
        rows: of the table, of one sweep.

    Returns:
        The candidates, and "none" where they might be none of them.
    """
    return [*names_in(rows["candidates"].iloc[0]), *([NONE] if f"p_{NONE}" in rows else [])]


def right_names(rows: pd.DataFrame) -> list[str]:
    """Say what it was right to call the object of each row.

    Args:
        rows: of the table, of one sweep.

    Returns:
        Its shape, or "none" where it was none of the candidates and might be.
    """
    labels = labels_in(rows)
    return [NONE if NONE in labels and shape not in labels else shape for shape in rows["shape"]]


class Results:
    """The rows of a sweep in `folder`, each as the text that stands in the file, so that resuming changes no bit."""

    def __init__(
        self,
        folder: Path,
        config: Mapping[str, Any],
        columns: Sequence[str],
        numbers: Sequence[str],
        order: Sequence[str],
        needed: Collection[str] = (),
    ) -> None:
        """Read the table, as far as it is there.

        Args:
            folder: of the sweep.
            config: what all rows share; it is written to the folder, and compared with what is there.
            columns: of the table.
            numbers: columns that hold numbers, or nothing.
            order: of a trial's observers.
            needed: those of `UNTOLD` that the table is to have; others it keeps where it has them.

        Raises:
            ValueError: for a folder that holds another configuration, or a table that is corrupt.
        """
        self.folder, self.order, self.path = folder, list(order), folder / "trials.csv"
        spared = {*UNTOLD} - {*needed, *self._header()}
        self.columns = [name for name in columns if name not in spared]
        self.numbers = {*numbers} - spared
        self._check_config(config)
        self.trials: dict[Key, list[Row]] = {}
        if self.path.exists():
            if self._read():
                self.rewrite()
        else:
            self.rewrite()

    def append(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Add a finished trial, in one write that reaches the disk.

        Args:
            rows: of the trial, one for each observer.
        """
        text = [{name: _text(row[name]) for name in self.columns} for row in rows]
        self.trials[self._key(text[0])] = text
        with self.path.open("ab") as file:
            file.write("".join(map(self._line, text)).encode())
            file.flush()
            os.fsync(file.fileno())

    def rewrite(self) -> None:
        """The same table in the order of `KEY`, whatever the order in which trials finished."""
        with atomic(self.path) as place:
            write_text(place, self._table(sorted(self.trials)))

    def _key(self, row: Row) -> Key:
        told: dict[str, Any] = {**USUAL, **row}
        return tuple(float(told[name]) if name in self.numbers else told[name] for name in KEY[:-1])

    def _table(self, keys: Iterable[Key]) -> str:
        return _csv([*self.columns, CHECK]) + "".join(self._line(row) for key in keys for row in self.trials[key])

    def _line(self, row: Row) -> str:
        fields = [row[name] for name in self.columns]
        return _csv([*fields, checksum(fields)])

    def _header(self) -> list[str]:
        """The columns of the table that is there; none where it has no first line that could be read."""
        try:
            with self.path.open(encoding="utf-8-sig") as file:
                return self._fields(1, file.readline().rstrip("\n"))
        except (FileNotFoundError, ValueError):
            return []

    def _check_config(self, config: Mapping[str, Any]) -> None:
        path = self.folder / "config.json"
        if not path.exists():
            if self.path.exists():
                raise ValueError(f"{self.path} has no config.json beside it, so nobody knows what it holds")
            write_json(path, config)
            return
        try:
            there = json.loads(path.read_text(encoding="utf-8-sig"))
        except (ValueError, RecursionError) as error:
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
        """Read the table; whether it means the same as another text."""
        # What an editor does to ends of lines is undone, and a half-written end is dropped.
        content = self.path.read_bytes()
        whole, newline, end = content.rpartition(b"\n")  # an end is there where the last line was being written
        try:
            text = (whole + newline).decode()
        except UnicodeDecodeError as error:
            raise ValueError(f"{self.path} is corrupt: {error}") from error
        lines = text.removeprefix("\ufeff").replace("\r\n", "\n").split("\n")[:-1]
        header = self._fields(1, lines[0]) if lines else []
        there = [name for name in self.columns if name not in UNTOLD or name in header]
        if header != [*there, CHECK]:
            raise ValueError(f"{self.path}, line 1: the columns are not those of this table; choose another --out")
        seen: dict[tuple[Key, str], int] = {}
        for number, line in enumerate(lines[1:], start=2):
            if line:
                self._take(number, line, seen, there)
        if end:
            with suppress(ValueError):
                self._take(len(lines) + 1, end.decode(), seen, there)
        for key, rows in list(self.trials.items()):
            observers = [row["observer"] for row in rows]
            if observers == self.order:
                continue
            if key != list(self.trials)[-1] or observers != self.order[: len(observers)]:
                raise ValueError(f"{self.path} is corrupt: the trial {key} has rows of {', '.join(observers)}")
            del self.trials[key]  # the last one, cut off between two of its rows
        return content != self._table(self.trials).encode()

    def _take(self, number: int, line: str, seen: dict[tuple[Key, str], int], columns: list[str]) -> None:
        """Add the row of a `line` that has `columns`; `seen`: in which line each row was before."""
        row = self._row(number, self._fields(number, line), columns)
        key = self._key(row)
        first = seen.setdefault((key, row["observer"]), number)
        if first != number:
            raise ValueError(
                f"{self.path}, line {number}: the trial and observer of line {first} once more; delete one of them"
            )
        self.trials.setdefault(key, []).append(row)

    def _fields(self, number: int, line: str) -> list[str]:
        try:
            return next(csv.reader([line]), [])
        except csv.Error as error:
            raise ValueError(f"{self.path}, line {number}: {error}; the table is corrupt") from error

    def _row(self, number: int, fields: list[str], columns: list[str]) -> Row:
        if len(fields) != len(columns) + 1:
            raise ValueError(
                f"{self.path}, line {number}: {len(fields)} fields, not {len(columns) + 1}; the table is corrupt"
            )
        *fields, check = fields
        row = {name: str(value) for name, value in USUAL.items() if name in self.columns}
        row |= dict(zip(columns, fields, strict=True))
        for name in self.numbers:
            try:
                float(row[name] or "nan")
            except ValueError:
                raise ValueError(
                    f"{self.path}, line {number}: {name} must be a number, got {row[name]!r}; the table is corrupt"
                ) from None
        if check != checksum(fields):
            raise ValueError(
                f"{self.path}, line {number}: it was altered, as its {CHECK} says, {check!r} in place of "
                f"{checksum(fields)!r}; put it back, or delete all rows of its trial, which then runs again"
            )
        return row


def _csv(fields: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(fields)
    return text.getvalue()


def checksum(fields: Sequence[str]) -> str:
    """Tell a row from one in which anything was changed.

    Args:
        fields: of the row, but for the last.

    Returns:
        The last one; it begins with letters, so that nobody takes it for a number.
    """
    return f"crc{zlib.crc32(_csv(fields).encode()):08x}"


def _text(value: Any) -> str:
    """As it stands in the table: floats so that they read back the same, NaN as an empty field."""
    if isinstance(value, float):
        return "" if value != value else repr(float(value))
    return str(value)


def _short(value: Any) -> str:
    return "absent" if value is None else json.dumps(value)
