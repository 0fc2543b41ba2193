"""Checks of user input: every error quotes the value and lists what is valid."""

from __future__ import annotations

import difflib
import math
import sys
from collections.abc import Collection, Iterable
from numbers import Integral, Real
from typing import Any

import numpy as np
from numba import types
from numpy.typing import ArrayLike, NDArray

from haptic_env.compiled import GIVEN, inner

LARGEST = sys.float_info.max


def choice(what: str, value: Any, valid: Collection[str]) -> str:
    """Return `value` if it is one of `valid`; else raise `ValueError` that lists them."""
    if isinstance(value, str) and value in valid:
        return value
    near = difflib.get_close_matches(str(value), valid, n=1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    raise ValueError(f"unknown {what} {value!r}{hint}; choose from {', '.join(sorted(valid))}")


def keywords(what: str, given: Iterable[str], valid: Collection[str]) -> None:
    """Raise `ValueError` at the first keyword in `given` that is not in `valid`."""
    for name in given:
        choice(f"{what} keyword", name, valid)


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
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ValueError(f"{what} must be {valid}, got {value!r}")
    result = float(value)
    if not math.isfinite(result) or not low <= result <= high or (above is not None and result <= above):
        raise ValueError(f"{what} must be {valid}, got {value!r}")
    return result


def integer(what: str, value: Any, low: int, high: int | None = None) -> int:
    """Return `value` as an int in [low, high]; else raise `ValueError`."""
    valid = f"an integer of at least {low}" if high is None else f"an integer in [{low}, {high}]"
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ValueError(f"{what} must be {valid}, got {value!r}")
    result = int(value)
    if result < low or (high is not None and result > high):
        raise ValueError(f"{what} must be {valid}, got {value!r}")
    return result


def boolean(what: str, value: object) -> bool:
    """Return `value` if it is True or False; else raise `ValueError`."""
    if not isinstance(value, bool):
        raise ValueError(f"{what} must be True or False, got {value!r}")
    return value


def array(
    what: str, value: ArrayLike, shape: tuple[int, ...], unit: str = "", *, bound: float = LARGEST
) -> NDArray[np.float64]:
    """Return `value` as a finite float64 array of `shape`, none beyond ± `bound`; else raise `ValueError`."""

    def refused(got: str) -> ValueError:
        return ValueError(f"{what} must be finite numbers of shape {shape}{f' in {unit}' if unit else ''}, got {got}")

    try:
        result = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise refused(repr(value)) from error
    if result.shape != shape:
        raise refused(f"shape {result.shape}")
    if not _within(result.reshape(-1), bound):
        if np.isfinite(result).all():
            raise ValueError(f"{what} must lie in [{-bound:g}, {bound:g}], got {result.tolist()}")
        raise refused(repr(value))
    return result


@inner(types.boolean(GIVEN, types.float64))
def _within(numbers: NDArray[np.float64], bound: float) -> bool:
    """Whether none of `numbers` (M,) is beyond ± `bound`, or NaN: the control loop asks at every step."""
    inside = True
    for each in numbers:
        inside &= abs(each) <= bound
    return inside


def binary(what: str, value: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return `value` as a boolean array of `shape` if every entry is 0 or 1; else `ValueError`."""
    result = np.asarray(value)
    if result.shape != shape:
        raise ValueError(f"{what} must be 0 or 1 of shape {shape}, got shape {result.shape}")
    if result.dtype != np.bool_:
        wrong = ~((result == 0) | (result == 1))
        if wrong.any():
            raise ValueError(f"{what} must be 0 or 1, got {result[wrong][0].item()!r} at index {int(np.argmax(wrong))}")
    return result.astype(np.bool_)
