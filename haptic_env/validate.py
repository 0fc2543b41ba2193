"""Checks of user input: every error quotes the value and lists what is valid."""

from __future__ import annotations

import difflib
import inspect
import math
import os
import sys
import unicodedata
from collections.abc import Callable, Collection, Iterable, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np
from numba import types
from numpy.typing import ArrayLike, NDArray

from haptic_env.compiled import GIVEN, inner

LARGEST = sys.float_info.max
FARTHEST = 100.0  # metres along each axis: nothing that a hand explores lies further away
LONGEST_TIME = 1e9  # seconds, thirty years
LONGEST = 1e6  # of a quaternion's numbers: their squares are numbers too
REAL = "biuf"  # kinds of arrays that are numbers: no complex ones, no text, no times, no objects
MOST = 2**28  # entries of an array of any length: as numbers they take 2 GiB
NOT_IN_PATHS = ("Cc", "Cs", "Zl", "Zp")  # control characters, bytes that are no text, ends of lines
NO_NUMBERS = (bool, np.timedelta64)  # which count as integers all the same
QUOTED = 300  # characters of a value that an error quotes


def shown(value: object) -> str:
    """`value` as an error quotes it: in one line, and no more than its beginning."""
    try:
        text = " ".join(line.strip() for line in repr(value).splitlines())
    except Exception:  # of an int of thousands of digits, say, or whatever a stranger's class does
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= QUOTED else f"{text[:QUOTED]}…"


def plain(name: object) -> str:
    """`name` as an error tells it: as it is where that can be printed in a line, else quoted."""
    text = str(name)
    return text if text.isprintable() and 0 < len(text) <= QUOTED else shown(text)


def listed(names: Iterable[object]) -> str:
    """`names`, one after the other, as an error tells them."""
    return ", ".join(map(plain, names))


def choice(what: str, value: Any, valid: Collection[str]) -> str:
    """Return `value` if it is one of `valid`; else raise `ValueError` that lists them."""
    if isinstance(value, str) and value in valid:
        return value
    near = difflib.get_close_matches(value[:QUOTED], valid, n=1) if isinstance(value, str) else []
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    raise ValueError(f"unknown {what} {shown(value)}{hint}; choose from {', '.join(sorted(valid))}")


def names(what: str, value: Any) -> tuple[str, ...]:
    """Return `value` if it is texts one after the other, one at least; else raise `ValueError`."""
    several = isinstance(value, Sequence) and not isinstance(value, str)
    if not several or not value or not all(isinstance(each, str) for each in value):
        raise ValueError(f"{what} must be one name or more, got {shown(value)}")
    return tuple(value)


def keywords(what: str, given: Iterable[str], valid: Collection[str]) -> None:
    """Raise `ValueError` at the first keyword in `given` that is not in `valid`."""
    for name in given:
        choice(f"{what} keyword", name, valid)


def keywords_of(function: Callable[..., Any]) -> list[str]:
    """List the arguments that a function or class takes by keyword alone.

    Args:
        function: with a signature.

    Returns:
        Their names, in order.
    """
    parameters = inspect.signature(function).parameters.values()
    return [each.name for each in parameters if each.kind is inspect.Parameter.KEYWORD_ONLY]


def number(
    what: str,
    value: Any,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    above: float | None = None,
    unit: str = "",
) -> float:
    """Return `value` as a finite float in [low, high] (and > `above`); else `ValueError`."""
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
    """Return `value` as a time that a trial can be counted in steps of: a number of at least 0, and > `above`; else
    raise `ValueError`."""
    return number(what, value, 0.0, LONGEST_TIME, above=above, unit="s")


def integer(what: str, value: Any, low: int, high: int | None = None) -> int:
    """Return `value` as an int in [low, high]; else raise `ValueError`."""
    valid = f"an integer of at least {low}" if high is None else f"an integer in [{low}, {high}]"
    if isinstance(value, NO_NUMBERS) or not isinstance(value, Integral):
        raise ValueError(f"{what} must be {valid}, got {shown(value)}")
    result = int(value)
    if result < low or (high is not None and result > high):
        raise ValueError(f"{what} must be {valid}, got {shown(value)}")
    return result


def seed(value: Any) -> int | None:
    """Return `value` if chance can start from it: None, which is other chance every time, or an integer of at least 0;
    else raise `ValueError`."""
    return None if value is None else integer("seed", value, 0)


def instance(what: str, value: object, kind: type | tuple[type, ...], hint: str) -> None:
    """Raise `ValueError` with the `hint` where `value` is none of `kind`."""
    if not isinstance(value, kind):
        raise ValueError(f"{what} must be {hint}, got {shown(value)}")


def path(what: str, value: object) -> Path:
    """Return `value` as a path that a file can have, and that can be told in a line; else raise `ValueError`."""
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str) or not text or any(unicodedata.category(each) in NOT_IN_PATHS for each in text):
        raise ValueError(f"{what} must be the path of a file, of printable characters, got {shown(value)}")
    return Path(text)


def boolean(what: str, value: object) -> bool:
    """Return `value` if it is True or False; else raise `ValueError`."""
    if not isinstance(value, bool):
        raise ValueError(f"{what} must be True or False, got {shown(value)}")
    return value


def array(
    what: str,
    value: ArrayLike,
    shape: tuple[int, ...],
    unit: str = "",
    *,
    bound: float = LARGEST,
    names: Sequence[str] = (),
) -> NDArray[np.float64]:
    """Return `value` as a finite float64 array of `shape`, none beyond ± `bound`; else raise `ValueError`, which calls
    an entry that is wrong by its name in `names`."""

    def refused(got: str) -> ValueError:
        return ValueError(f"{what} must be finite numbers of shape {shape}{f' in {unit}' if unit else ''}, got {got}")

    given = real(value)
    if given is None:
        raise refused(shown(value))
    if given.shape != shape:
        raise refused(f"shape {given.shape}")
    result = _float64(given)
    if not _within(result.reshape(-1), bound):
        if not np.isfinite(result).all():
            raise refused(_first(given, ~np.isfinite(result), names))
        got = _first(given, np.abs(result) > bound, names) if names else shown(result.tolist())
        raise ValueError(f"{what} must lie in [{-bound:g}, {bound:g}]{f' {unit}' if unit else ''}, got {got}")
    return result


def place(what: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return `value` as a point (3,) m, no coordinate beyond ± `FARTHEST`; else raise `ValueError`."""
    return array(what, value, (3,), "m", bound=FARTHEST)


def quaternion(what: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return `value` as a quaternion (4,) wxyz of any length but zero; else raise `ValueError`."""
    result = array(what, value, (4,), bound=LONGEST)
    if float(result @ result) < 1e-12:
        raise ValueError(f"{what} (wxyz) must not be zero, got {result.tolist()}")
    return result


def numbers(
    what: str, value: ArrayLike, dimensions: int | None = None, *, bound: float = LARGEST
) -> NDArray[np.float64]:
    """Return `value` as a finite float64 array of any shape, or of any of so many `dimensions`, none beyond ± `bound`;
    else `ValueError`."""
    many = "" if dimensions is None else f" of {dimensions} dimension{'s' * (dimensions != 1)}"
    given = real(value)
    if given is None:
        raise ValueError(f"{what} must be an array of finite numbers{many}, got {shown(value)}")
    _fits_memory(what, given)
    if dimensions is not None and given.ndim != dimensions:
        raise ValueError(f"{what} must be an array of finite numbers{many}, got shape {given.shape}")
    result = _float64(given)
    wrong = ~np.isfinite(result)
    if wrong.any():
        raise ValueError(f"{what} must be an array of finite numbers{many}, got {_first(given, wrong)}")
    wrong = np.abs(result) > bound
    if wrong.any():
        raise ValueError(f"{what} must lie in [{-bound:g}, {bound:g}], got {_first(given, wrong)}")
    return result


def together(bound: float = LARGEST, /, **arrays: ArrayLike) -> list[NDArray[np.float64]]:
    """Return `arrays` of finite numbers, none beyond ± `bound`, all of the one shape that they can be broadcast to;
    else `ValueError`."""
    checked = {what: numbers(what, value, bound=bound) for what, value in arrays.items()}
    try:
        result = list(np.broadcast_arrays(*checked.values()))
    except ValueError:
        shapes = ", ".join(f"{what} of {value.shape}" for what, value in checked.items())
        raise ValueError(f"{' and '.join(checked)} must be of one shape, got {shapes}") from None
    _fits_memory(" and ".join(checked), result[0])
    return result


def probabilities(what: str, value: ArrayLike, dimensions: int | None = None) -> NDArray[np.float64]:
    """The same of numbers in [0, 1]."""
    result = numbers(what, value, dimensions)
    wrong = (result < 0.0) | (result > 1.0)
    if wrong.any():
        raise ValueError(f"{what} must be probabilities in [0, 1], got {_first(result, wrong)}")
    return result


def real(value: ArrayLike) -> NDArray[Any] | None:
    """`value` as an array; None for one that is no array of real numbers, or of which entries are masked."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        return None
    try:
        result = np.asarray(value)
    except Exception:  # whatever a stranger's array makes of it
        return None
    return result if result.dtype.kind in REAL else None


def binary(what: str, value: ArrayLike, shape: tuple[int, ...] | None = None) -> NDArray[np.bool_]:
    """Return `value` as a boolean array of `shape` (None: any) if every entry is 0 or 1; else `ValueError`."""
    of = "" if shape is None else f" of shape {shape}"
    result = real(value)
    if result is None:
        raise ValueError(f"{what} must be 0 or 1{of}, got {shown(value)}")
    if shape is not None and result.shape != shape:
        raise ValueError(f"{what} must be 0 or 1{of}, got shape {result.shape}")
    _fits_memory(what, result)
    if result.dtype != np.bool_:
        wrong = ~((result == 0) | (result == 1))
        if wrong.any():
            raise ValueError(f"{what} must be 0 or 1, got {_first(result, wrong)}")
    return result.astype(np.bool_)


def _fits_memory(what: str, given: NDArray[Any]) -> None:
    """Raise `ValueError` for an array that is as large as it can be without having its numbers."""
    if given.size > MOST:
        raise ValueError(f"{what} must have {MOST} entries at most, got shape {given.shape}")


def _first(values: NDArray[Any], wrong: NDArray[np.bool_], names: Sequence[str] = ()) -> str:
    """Which of `values` is the first that is `wrong`, and where."""
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    where = f" at index {index[0] if len(index) == 1 else index}" if index else ""
    if names:
        where = f" at {names[index[0]]!r}"
    return f"{values[index].item()!r}{where}"


def _float64(numbers: NDArray[Any]) -> NDArray[np.float64]:
    if numbers.dtype.itemsize <= 8:
        return numbers.astype(np.float64, copy=False)
    with np.errstate(over="ignore"):  # of wider numbers, which are infinite then
        return numbers.astype(np.float64)


@inner(types.boolean(GIVEN, types.float64))
def _within(numbers: NDArray[np.float64], bound: float) -> bool:
    """Whether none of `numbers` (M,) is beyond ± `bound`, or NaN: the control loop asks at every step."""
    inside = True
    for each in numbers:
        inside &= abs(each) <= bound
    return inside
