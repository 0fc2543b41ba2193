"""Checks of arrays of numbers."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env.validate.values import number
from haptic_env.validate.wording import shown

LARGEST = sys.float_info.max
FARTHEST = 100.0  # metres along each axis: nothing that a hand explores lies further away
LONGEST = 1e6  # of a quaternion's numbers: their squares are numbers too
REAL = "biuf"  # kinds of arrays that are numbers: no complex ones, no text, no times, no objects
MOST = 2**28  # entries of an array of any length: as numbers they take 2 GiB


def array(
    what: str,
    value: ArrayLike,
    shape: tuple[int, ...],
    unit: str = "",
    *,
    bound: float = LARGEST,
    names: Sequence[str] = (),
) -> NDArray[np.float64]:
    """Check numbers of one shape.

    Args:
        what: the value is, for the message.
        value: that was given.
        shape: that it must have.
        unit: for the message.
        bound: none may lie beyond ± this.
        names: of the entries along the first axis, for the message.

    Returns:
        A float64 array of `shape`: the value itself where it is one.

    Raises:
        ValueError: for another shape, or an entry that is not finite or beyond the bound.
    """

    def wanted() -> str:  # asked where it is needed: the control loop is here at every step
        return f"{what} must be finite numbers of shape {shape}{f' in {unit}' if unit else ''}"

    given = real(value)
    if given is None:
        raise ValueError(f"{wanted()}, got {shown(value)}")
    if given.shape != shape:
        raise ValueError(f"{wanted()}, got shape {given.shape}")
    result = _float64(given)
    if not _within()(result.reshape(-1), bound):
        if not np.isfinite(result).all():
            raise ValueError(f"{wanted()}, got {_first(given, ~np.isfinite(result), names)}")
        got = _first(given, np.abs(result) > bound, names) if names else shown(result.tolist())
        raise ValueError(f"{what} must lie in [{-bound:g}, {bound:g}]{f' {unit}' if unit else ''}, got {got}")
    return result


def place(what: str, value: ArrayLike) -> NDArray[np.float64]:
    """Check a point.

    Args:
        what: the value is, for the message.
        value: that was given.

    Returns:
        (3,) m, none beyond ± `FARTHEST`.

    Raises:
        ValueError: for anything else.
    """
    return array(what, value, (3,), "m", bound=FARTHEST)


def quaternion(what: str, value: ArrayLike) -> NDArray[np.float64]:
    """Check a quaternion.

    Args:
        what: the value is, for the message.
        value: that was given.

    Returns:
        (4,) wxyz, of any length but zero.

    Raises:
        ValueError: for anything else.
    """
    result = array(what, value, (4,), bound=LONGEST)
    if float(result @ result) < 1e-12:
        raise ValueError(f"{what} (wxyz) must not be zero, got {result.tolist()}")
    return result


def numbers(
    what: str, value: ArrayLike, dimensions: int | None = None, *, bound: float = LARGEST
) -> NDArray[np.float64]:
    """Check numbers of any shape.

    Args:
        what: the value is, for the message.
        value: that was given.
        dimensions: how many it must have; None: any.
        bound: none may lie beyond ± this.

    Returns:
        A float64 array: the value itself where it is one.

    Raises:
        ValueError: for what are no numbers, more than `MOST`, of other dimensions, or an entry that is not finite or
            beyond the bound.
    """
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


def one_or_each(
    what: str, value: Any, count: int | None, low: float, high: float, *, unit: str = "", of: str = "joint"
) -> float | NDArray[np.float64]:
    """Check a number that may be another for each of several.

    Args:
        what: the value is, for the message.
        value: that was given.
        count: of the several; None: there are none.
        low: the least that is valid.
        high: the largest that is valid.
        unit: for the message.
        of: what there are several of, for the message.

    Returns:
        A finite float, or (count,), the caller's own.

    Raises:
        ValueError: for anything else.
    """
    if count is None or not isinstance(value, list | tuple | np.ndarray):
        return number(what, value, low, high, unit=unit)
    valid = f"a finite number in [{low:g}, {high:g}]{f' {unit}' if unit else ''}, or {count}, one for each {of}"
    given = real(value)
    if given is None:
        raise ValueError(f"{what} must be {valid}, got {shown(value)}")
    if given.shape != (count,):
        raise ValueError(f"{what} must be {valid}, got shape {given.shape}")
    result = np.array(_float64(given))
    wrong = ~((result >= low) & (result <= high))
    if wrong.any():
        raise ValueError(f"{what} must be {valid}, got {_first(given, wrong)}")
    return result


def together(bound: float = LARGEST, /, **arrays: ArrayLike) -> list[NDArray[np.float64]]:
    """Check numbers that belong together.

    Args:
        bound: none may lie beyond ± this.
        **arrays: by what they are, for the message.

    Returns:
        Float64 arrays of the one shape that all can be broadcast to.

    Raises:
        ValueError: where there is no such shape, or for an array that `numbers` refuses.
    """
    checked = {what: numbers(what, value, bound=bound) for what, value in arrays.items()}
    try:
        result = list(np.broadcast_arrays(*checked.values()))
    except ValueError:
        shapes = ", ".join(f"{what} of {value.shape}" for what, value in checked.items())
        raise ValueError(f"{' and '.join(checked)} must be of one shape, got {shapes}") from None
    _fits_memory(" and ".join(checked), result[0])
    return result


def probabilities(what: str, value: ArrayLike, dimensions: int | None = None) -> NDArray[np.float64]:
    """Check probabilities.

    Args:
        what: the value is, for the message.
        value: that was given.
        dimensions: how many it must have; None: any.

    Returns:
        A float64 array, all in [0, 1].

    Raises:
        ValueError: for anything else.
    """
    result = numbers(what, value, dimensions)
    wrong = (result < 0.0) | (result > 1.0)
    if wrong.any():
        raise ValueError(f"{what} must be probabilities in [0, 1], got {_first(result, wrong)}")
    return result


def real(value: ArrayLike) -> NDArray[Any] | None:
    """Make an array of a value.

    Args:
        value: anything.

    Returns:
        The array; None where it is none of real numbers, or entries are masked.
    """
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        return None
    try:
        result = np.asarray(value)
    except Exception:  # whatever a stranger's array makes of it
        return None
    return result if result.dtype.kind in REAL else None


def binary(what: str, value: ArrayLike, shape: tuple[int, ...] | None = None) -> NDArray[np.bool_]:
    """Check an array of zeros and ones.

    Args:
        what: the value is, for the message.
        value: that was given.
        shape: that it must have; None: any.

    Returns:
        A boolean array.

    Raises:
        ValueError: for anything else.
    """
    of = "" if shape is None else f" of shape {shape}"
    result = real(value)
    if result is None:
        raise ValueError(f"{what} must be 0 or 1{of}, got {shown(value)}")
    if shape is not None and result.shape != shape:
        raise ValueError(f"{what} must be 0 or 1{of}, got shape {result.shape}")
    _fits_memory(what, result)
    if result.dtype != np.bool_:
        one_byte = result.dtype.kind in "iu" and result.dtype.itemsize == 1  # as an environment's contacts
        wrong = result.view(np.uint8) > 1 if one_byte else ~((result == 0) | (result == 1))
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


@cache
def _within() -> Callable[[NDArray[np.float64], float], bool]:
    """A kernel, loaded when it is first asked for: numba takes most of a second, and a wrong file is told without."""
    from haptic_env.validate.bounds import within

    return within
