"""What may stand in the cells of a table of trials; every fault is told with its lines and its column."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from haptic_env import shapes, validate
from haptic_env.shapes.names import NONE
from haptic_env.validate import LONGEST_TIME

MISSING = ("", "n/a", "na", "nan", "null")
WORDS = (NONE, "yes", "no")  # what a response may be that is no object
SHOWN = 10  # lines and values that a message tells
LONGEST = 200  # letters of a cell
COMMA = re.compile(r"[-+]?\d+,\d+")


class Source(NamedTuple):
    """Where rows come from, for messages.

    Attributes:
        name: of the file, or what else holds them.
        lines: (M,) numbers of the rows there.
        called: how such a number is called, "line" or "row".
    """

    name: str
    lines: Sequence[int]
    called: str = "line"

    def refuse(self, wrong: NDArray[np.bool_], what: str) -> None:
        """Raise an error where rows are wrong.

        Args:
            wrong: (M,) which are.
            what: is wrong, for the message.

        Raises:
            ValueError: where any is.
        """
        if wrong.any():
            raise ValueError(f"{self.name}, {self.told(wrong)}: {what}")

    def told(self, rows: NDArray[np.bool_]) -> str:
        """Tell rows by their numbers.

        Args:
            rows: (M,) which.

        Returns:
            "line 3", "lines 3, 17, 20" or "lines 3, 17, … (80 in all)".
        """
        numbers = [self.lines[int(index)] for index in np.flatnonzero(rows)]
        more = f", … ({len(numbers)} in all)" if len(numbers) > SHOWN else ""
        return f"{self.called}{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers[:SHOWN]))}{more}"


def tidy(cell: object) -> str:
    """Take text from a cell.

    Args:
        cell: of a table, of any type.

    Returns:
        The text in one form (NFC), with single spaces; "" where the cell says that it is missing.
    """
    text = " ".join(unicodedata.normalize("NFC", "" if _is_nan(cell) else str(cell)).split())
    return "" if text.casefold() in MISSING else text


def texts(source: Source, column: str, cells: pd.Series, *, optional: bool) -> pd.Series:
    """Check words.

    Args:
        source: of the cells.
        column: what they are called, for messages.
        cells: (M,).
        optional: whether some may be missing.

    Returns:
        (M,) texts, "" where they are missing.

    Raises:
        ValueError: for what is missing, too long, or cannot be printed.
    """
    known = {cell: tidy(cell) for cell in cells.unique()}
    result = cells.map(known) if len(cells) else cells.astype(str)
    if not optional:
        source.refuse((result == "").to_numpy(), f"{column} is missing, and every trial needs one")
    wrong = result.map(lambda text: len(text) > LONGEST or not text.isprintable()).to_numpy(dtype=bool)
    source.refuse(wrong, f"{column} must be at most {LONGEST} characters that can be printed{_got(result[wrong])}")
    return result


def numbers(source: Source, column: str, cells: pd.Series, *, optional: bool, unit: str = "") -> pd.Series:
    """Check numbers.

    Args:
        source: of the cells.
        column: what they are called, for messages.
        cells: (M,) texts or numbers.
        optional: whether some may be missing.
        unit: for messages.

    Returns:
        (M,) finite numbers, NaN where they are missing.

    Raises:
        ValueError: for anything else.
    """
    told = cells.map(tidy) if len(cells) else cells.astype(str)
    missing = (told == "").to_numpy() | (told.map(str.casefold) == NONE).to_numpy()
    if not optional:
        source.refuse(missing, f"{column} is missing, and every trial needs one")
    commas = told.map(lambda text: COMMA.fullmatch(text) is not None).to_numpy(dtype=bool)
    source.refuse(commas, f"{column} has a decimal comma{_got(told[commas])}: write a point, as in 2.5")
    result = pd.to_numeric(told.mask(missing), errors="coerce").astype(np.float64)
    wrong = ~missing & ~np.isfinite(result.to_numpy())
    of = f" ({unit})" if unit else ""
    source.refuse(wrong, f"{column} must be a number{of}{_got(told[wrong])}")
    return result


def within(source: Source, column: str, values: pd.Series, valid: Callable[[pd.Series], pd.Series], said: str) -> None:
    """Check that numbers lie where they may.

    Args:
        source: of the numbers.
        column: what they are called, for messages.
        values: (M,), NaN where they are missing.
        valid: says which are.
        said: what is valid, for the message.

    Raises:
        ValueError: where some do not.
    """
    wrong = (values.notna() & ~valid(values)).to_numpy()
    source.refuse(wrong, f"{column} must be {said}{_got(values[wrong])}")


def times(source: Source, column: str, values: pd.Series, *, above: bool) -> None:
    """Check times.

    Args:
        source: of the times.
        column: what they are called, for messages.
        values: (M,) s, NaN where they are missing.
        above: whether none may be 0.

    Raises:
        ValueError: where some are negative or longer than any trial.
    """
    said = f"in {'(' if above else '['}0, {LONGEST_TIME:g}] s"
    within(source, column, values, lambda t: ((t > 0) if above else (t >= 0)) & (t <= LONGEST_TIME), said)


def shapes_of(source: Source, column: str, cells: pd.Series, *, words: Sequence[str], free: bool) -> pd.Series:
    """Check names of objects.

    Args:
        source: of the names.
        column: what they are called, for messages.
        cells: (M,) texts.
        words: what may stand there besides shapes, however its letters are.
        free: whether any name will do.

    Returns:
        (M,) names, each always written the same way.

    Raises:
        ValueError: for names that are of no shape; all are told.
    """
    meant: dict[str, str] = {}
    unknown: dict[str, str] = {}
    for cell in cells.unique():
        if cell.casefold() in words:
            meant[cell] = cell.casefold()
            continue
        try:
            meant[cell] = shapes.check(column, cell)
        except (ValueError, OSError) as error:
            meant[cell] = cell
            unknown[cell] = str(error)
    if unknown and not free:
        several = f" (and {validate.listed(list(unknown)[1:SHOWN])})" if len(unknown) > 1 else ""
        also = f"; or {', '.join(words)}" if words else ""
        raise ValueError(
            f"{source.name}, {source.told(cells.isin(list(unknown)).to_numpy())}: {next(iter(unknown.values()))}"
            f"{several}{also}. Say what a name of your own is, as in --name ball=sphere, or take any names as they are "
            "with --free-names"
        )
    return cells.map(meant) if len(cells) else cells


def _got(values: pd.Series) -> str:
    several = list(dict.fromkeys(values))
    more = ", …" if len(several) > 3 else ""
    return f", got {', '.join(map(validate.shown, several[:3]))}{more}"


def _is_nan(cell: object) -> bool:
    return cell is None or cell is pd.NA or (isinstance(cell, float) and cell != cell)
