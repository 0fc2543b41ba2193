"""Tables of what people answered, a row for each trial: CSV and TSV, and events as BIDS has them.

Of M trials: `subject`, `object` (as `--shapes` says it), `response` (an object, "none", "yes" or "no"), `seconds` (s,
the time explored), and where there are any `condition`, `confidence` (0 to 1), `response_time` (s), `deadline` (s, when
whoever answers by itself is asked), `recording` (path) and `trial` (a number of its own within a subject, made where
absent). Columns beyond these are kept after them.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from haptic_env import reading, validate
from haptic_lab.files import atomic
from haptic_lab.people import trial_checks as checks
from haptic_lab.people.trial_checks import Source
from haptic_lab.people.trial_columns import ALSO, COLUMNS, DEADLINE, OPTIONAL, REQUIRED, UNITS, TrialColumns

SEPARATORS = {".csv": ",", ".tsv": "\t"}
BIDS = re.compile(r"sub-([0-9a-zA-Z]+)_")  # begins the name of a file of one subject
TOLD = 30  # columns that a message tells
KEPT = "original_{}"  # an extra column that is called as one of ours


def read_trials(
    path: Path | str,
    columns: Mapping[str, str | float] | TrialColumns | None = None,
    *,
    free_names: bool = False,
) -> pd.DataFrame:
    """Read a table of trials.

    Args:
        path: of the file, `.csv` or `.tsv`, UTF-8, its first line the names of its columns.
        columns: what the table calls our columns, or all that is to be known of it; None: as we do, or BIDS.
        free_names: whether objects and responses may be called anything; otherwise they are shapes.

    Returns:
        (M,) trials with the columns above, checked.

    Raises:
        ValueError: for what is no such table; it names lines and column, and what is valid.
        OSError: where it cannot be read.
    """
    place = validate.path("path", path)
    meaning = columns if isinstance(columns, TrialColumns) else TrialColumns({} if columns is None else columns)
    table, lines = _rows(place)
    source = Source(str(place), lines)
    named = _named(source, table, meaning, BIDS.match(place.name))
    if "recording" in named:  # whoever reads the table may stand in another folder
        beside = place.parent.absolute()
        named["recording"] = named["recording"].map(
            lambda cell: str(beside / cell.strip()) if checks.tidy(cell) else ""
        )
    return _checked(source, named, meaning, free_names)


def check_trials(table: pd.DataFrame, *, free_names: bool = False) -> pd.DataFrame:
    """Check a table of trials that was made in Python.

    Args:
        table: (M,) trials, with the columns above.
        free_names: whether objects and responses may be called anything; otherwise they are shapes.

    Returns:
        A copy of its own, its columns in our order, and `trial` where it had none.

    Raises:
        ValueError: for what is no such table; it names rows and column, and what is valid.
    """
    validate.instance("table", table, pd.DataFrame, "a pandas.DataFrame")
    if table.columns.duplicated().any() or not all(isinstance(each, str) for each in table.columns):
        raise ValueError(f"table must have columns of different names, got {validate.shown(list(table.columns))}")
    source = Source("table", range(len(table)), "row")
    named = _named(source, table.reset_index(drop=True), TrialColumns(), None)
    return _checked(source, named, TrialColumns(), free_names)


def write_trials(table: pd.DataFrame, path: Path | str) -> None:
    """Write a table of trials, which `read_trials` reads as it is.

    Args:
        table: as `check_trials` takes it, of any names.
        path: of the file, `.csv` or `.tsv`.

    Raises:
        ValueError: for another ending, or a table that is none of trials.
        OSError: where it cannot be written.
    """
    place = validate.path("path", path)
    separator = SEPARATORS[validate.choice("ending of a table", place.suffix.lower(), SEPARATORS)]
    checked = check_trials(table, free_names=True)
    with atomic(place) as unfinished:
        checked.to_csv(unfinished, sep=separator, index=False, encoding="utf-8", lineterminator="\n")


def _rows(path: Path) -> tuple[pd.DataFrame, list[int]]:
    """The cells of a file as texts, and the line at which each row ends."""
    suffix = validate.choice("ending of a table", path.suffix.lower(), SEPARATORS)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file; a table of trials is a .csv or .tsv")
    try:
        text = reading.text(path)
        first = next((line for line in text.splitlines() if line.strip()), "")
        if not first:
            raise ValueError(f"it is empty; it must begin with a line of names, such as {','.join(REQUIRED)}")
        separator = SEPARATORS[suffix]
        if separator == "," and "," not in first and ";" in first:
            separator = ";"  # as spreadsheets write it where numbers have commas
        header, rows, lines = _parsed(text, separator)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if not rows:
        raise ValueError(f"{path}: it has a line of names, and no trials below it")
    return pd.DataFrame(rows, columns=pd.Index(header, dtype=object), dtype=object), lines


def _parsed(text: str, separator: str) -> tuple[list[str], list[list[str]], list[int]]:
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
    header: list[str] = []
    rows, lines, wrong = [], [], []
    try:
        for row in reader:
            if not any(cell.strip() for cell in row):
                continue  # spreadsheets leave such lines at the end
            if not header:
                header = [" ".join(name.split()) for name in row]
                _check_header(header)
                continue
            if len(row) != len(header):
                wrong.append((reader.line_num, len(row)))
            rows.append(row)
            lines.append(reader.line_num)
    except csv.Error as error:
        raise ValueError(f"line {reader.line_num}: {error}") from error
    if wrong:
        several = Source("", [line for line, _ in wrong]).told(np.ones(len(wrong), dtype=bool))
        hint = "was a number written with a comma?" if wrong[0][1] > len(header) else "was it cut short?"
        raise ValueError(f"{several}: {wrong[0][1]} cells in place of {len(header)}; {hint}")
    return header, rows, lines


def _check_header(header: list[str]) -> None:
    """Check the names of columns; those of columns that a spreadsheet left without one are told apart."""
    for index, name in enumerate(header):
        if not name.isprintable():
            raise ValueError(f"line 1: column {index + 1} must have a name that can be printed, got {name!r}")
        header[index] = name or f"column {index + 1}"
    twice = sorted({name for name in header if header.count(name) > 1})
    if twice:
        raise ValueError(f"line 1: columns {validate.listed(twice[:TOLD])} are there twice; which is meant?")


def _named(source: Source, table: pd.DataFrame, meaning: TrialColumns, file: re.Match[str] | None) -> pd.DataFrame:
    """The table with our names: first our columns, then its own."""
    found: dict[str, Any] = {}
    taken = set()
    for ours in COLUMNS:
        theirs = meaning.columns.get(ours, ours)
        if ours not in meaning.columns and ours not in table and ALSO.get(ours) in table:
            theirs = ALSO[ours]
        if theirs in table:
            found[ours] = table[theirs]
            taken.add(theirs)
        elif isinstance(theirs, float | int):
            found[ours] = pd.Series(float(theirs), index=table.index)
        elif ours in meaning.columns:
            there = _there(table)
            raise ValueError(f"{source.name}: no column {theirs!r}, which {ours} is said to be; there are {there}")
        elif ours == "subject" and file is not None:
            found[ours] = pd.Series(file[1], index=table.index)
    missing = [name for name in REQUIRED if name not in found]
    if missing:
        raise ValueError(_not_there(source, table, missing))
    extra = {name: table[name] for name in table if name not in taken}
    for name in [name for name in extra if name in COLUMNS]:
        extra[KEPT.format(name)] = extra.pop(name)
    clash = [name for name in extra if list(extra).count(name) > 1]
    if clash:
        raise ValueError(f"{source.name}: columns {validate.listed(clash[:TOLD])} are there twice")
    return pd.DataFrame({**found, **extra})


def _there(table: pd.DataFrame) -> str:
    """The columns of a table, which may be thousands."""
    names = list(table.columns)
    return validate.listed(names[:TOLD]) + (f" and {len(names) - TOLD} more" if len(names) > TOLD else "")


def _not_there(source: Source, table: pd.DataFrame, missing: list[str]) -> str:
    told = f"{source.name}: no column {validate.listed(missing)}; there are {_there(table)}"
    if len(table.columns) == 1:
        return f"{told}: is it separated by commas (.csv) or tabs (.tsv)?"
    hint = "seconds=5 where each trial took 5 s" if missing == ["seconds"] else f"{missing[0]}=NAME"
    return f"{told}. Say which it is, as in --column {hint}"


def _checked(source: Source, named: pd.DataFrame, meaning: TrialColumns, free: bool) -> pd.DataFrame:
    """Our columns checked, in our units; then the others as they are."""
    result: dict[str, Any] = {"subject": checks.texts(source, "subject", named["subject"], optional=False)}
    for name in ("object", "response"):
        cells = checks.texts(source, name, named[name], optional=False)
        renamed = cells.map(lambda cell: meaning.names.get(cell, cell))
        words = checks.WORDS if name == "response" else ()
        result[name] = checks.shapes_of(source, name, renamed, words=words, free=free)
    for name in ("seconds", "confidence", "response_time", DEADLINE):
        if name in named:
            result[name] = _measured(source, name, named[name], meaning.units.get(name))
    for name in ("condition", "recording"):
        if name in named:
            result[name] = checks.texts(source, name, named[name], optional=True)
    result["trial"] = _trials(source, named, result["subject"])
    order = [name for name in (*REQUIRED, *OPTIONAL) if name in result]
    extra = {name: _as_it_is(named[name]) for name in named if name not in COLUMNS}
    return pd.DataFrame({**{name: result[name] for name in order}, **extra})


def _measured(source: Source, name: str, cells: pd.Series, unit: str | None) -> pd.Series:
    usual = next(iter(UNITS[name]))
    values = checks.numbers(source, name, cells, optional=name != "seconds", unit=unit or usual)
    values = values / UNITS[name][unit or usual]
    if name != "confidence":
        checks.times(source, name, values, above=name == "seconds")
        return values
    hint = "; of per cent say --unit confidence=percent" if unit is None else ", 0 to 100 %"
    checks.within(source, name, values, lambda share: (share >= 0) & (share <= 1), f"in [0, 1]{hint}")
    return values


def _trials(source: Source, named: pd.DataFrame, subjects: pd.Series) -> pd.Series:
    """The number of each trial, each once within a subject."""
    if "trial" not in named:
        return subjects.groupby(subjects).cumcount() + 1
    values = checks.numbers(source, "trial", named["trial"], optional=False)
    checks.within(source, "trial", values, lambda n: (n % 1 == 0) & (n.abs() < 2**53), "a whole number")
    trials = values.astype(np.int64)
    twice = pd.DataFrame({"subject": subjects, "trial": trials}).duplicated(keep=False).to_numpy()
    source.refuse(twice, "a subject has a trial of one number more than once; each must have a number of its own")
    return trials


def _as_it_is(cells: pd.Series) -> pd.Series:
    """A column that we know nothing of: numbers where all cells are some, else texts."""
    if cells.dtype != object and not pd.api.types.is_string_dtype(cells):
        return cells
    told = cells.map(checks.tidy)
    values = pd.to_numeric(told.mask(told == ""), errors="coerce")
    coded = told.map(lambda text: re.match(r"[-+]?0\d", text) is not None)
    as_numbers = not coded.any() and (values.notna() == (told != "")).all() and values.notna().any()
    return values if as_numbers and np.isfinite(values.dropna()).all() else told
