"""Checks of single values: numbers, switches, paths."""

from __future__ import annotations

import math
import os
import unicodedata
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np

from haptic_env.validate.wording import shown

LONGEST_TIME = 1e9  # seconds, thirty years
NOT_IN_PATHS = ("Cc", "Cs", "Zl", "Zp")  # control characters, bytes that are no text, ends of lines
NO_NUMBERS = (bool, np.timedelta64)  # which count as integers all the same


def number(
    what: str,
    value: Any,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    above: float | None = None,
    unit: str = "",
) -> float:
    """Check a number.

    Args:
        what: the value is, for the message.
        value: that was given.
        low: the least that is valid.
        high: the largest that is valid.
        above: what the value must be larger than, if anything, in place of `low`.
        unit: for the message.

    Returns:
        A finite float.

    Raises:
        ValueError: for what is no number, or out of the range.
    """
    bounds = f"[{low:g}, {high:g}]" if above is None else f"({above:g}, {high:g}]"
    valid = f"a finite number in {bounds}" + (f" {unit}" if unit else "")
    if isinstance(value, NO_NUMBERS) or not isinstance(value, Real):
        raise ValueError(f"{what} must be {valid}, got {shown(value)}")
    try:
        result = float(value)
    except OverflowError:  # of an int
        result = math.inf
    if not math.isfinite(result) or not low <= result <= high or (above is not None and result <= above):
        raise ValueError(f"{what} must be {valid}, got {shown(value)}")
    return result


def seconds(what: str, value: Any, *, above: float | None = 0.0) -> float:
    """Check a time that a trial can be counted in steps of.

    Args:
        what: the value is, for the message.
        value: that was given.
        above: what it must be larger than; None: it may be 0.

    Returns:
        Seconds.

    Raises:
        ValueError: for anything else.
    """
    return number(what, value, 0.0, LONGEST_TIME, above=above, unit="s")


def integer(what: str, value: Any, low: int, high: int | None = None) -> int:
    """Check an integer.

    Args:
        what: the value is, for the message.
        value: that was given; True and False are none.
        low: the least that is valid.
        high: the largest that is valid, if there is one.

    Returns:
        A Python int.

    Raises:
        ValueError: for what is none, or out of the range.
    """
    valid = f"an integer of at least {low}" if high is None else f"an integer in [{low}, {high}]"
    if isinstance(value, NO_NUMBERS) or not isinstance(value, Integral):
        raise ValueError(f"{what} must be {valid}, got {shown(value)}")
    result = int(value)
    if result < low or (high is not None and result > high):
        raise ValueError(f"{what} must be {valid}, got {shown(value)}")
    return result


def seed(value: Any) -> int | None:
    """Check what chance starts from.

    Args:
        value: that was given.

    Returns:
        An integer of at least 0, or None, which is other chance every time.

    Raises:
        ValueError: for anything else.
    """
    return None if value is None else integer("seed", value, 0)


def instance(what: str, value: object, kind: type | tuple[type, ...], hint: str) -> None:
    """Check the type of a value.

    Args:
        what: the value is, for the message.
        value: that was given.
        kind: of which it must be.
        hint: what it must be, for the message: where to get one.

    Raises:
        ValueError: for a value of another type.
    """
    if not isinstance(value, kind):
        raise ValueError(f"{what} must be {hint}, got {shown(value)}")


def path(what: str, value: object) -> Path:
    """Check a path that a file can have, and that can be told in a line.

    Args:
        what: the value is, for the message.
        value: that was given.

    Returns:
        The path, whether or not there is a file.

    Raises:
        ValueError: for what is no path, is empty, or has characters that cannot be printed.
    """
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str) or not text or any(unicodedata.category(each) in NOT_IN_PATHS for each in text):
        raise ValueError(f"{what} must be the path of a file, of printable characters, got {shown(value)}")
    return Path(text)


def boolean(what: str, value: object) -> bool:
    """Check a switch.

    Args:
        what: the value is, for the message.
        value: that was given.

    Returns:
        The value.

    Raises:
        ValueError: for anything but True and False.
    """
    if not isinstance(value, bool):
        raise ValueError(f"{what} must be True or False, got {shown(value)}")
    return value
