"""Spaces of observations and actions as JSON, so that a file can say what its network was trained with."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from haptic_env import validate

LARGEST = 1_000_000  # numbers of a space
KINDS = ("box", "binary", "dict")
DTYPES = ("float32", "float64", "int8", "int16", "int32", "int64", "uint8")


def describe(space: gym.Space[Any]) -> dict[str, Any]:
    """Describe a space as JSON.

    Args:
        space: a Box, a MultiBinary or a Dict of such.

    Returns:
        What JSON can say.

    Raises:
        ValueError: for a space of another kind.
    """
    if isinstance(space, spaces.Dict):
        return {"kind": "dict", "spaces": [[name, describe(each)] for name, each in space.spaces.items()]}
    if isinstance(space, spaces.MultiBinary):
        return {"kind": "binary", "shape": list(space.shape)}
    if isinstance(space, spaces.Box):
        bounds = {name: _short(each) for name, each in (("low", space.low), ("high", space.high))}
        return {"kind": "box", "shape": list(space.shape), "dtype": str(space.dtype), **bounds}
    raise ValueError(f"a space must be a Box, a MultiBinary or a Dict of such, got {space}")


def restore(told: Any, what: str) -> gym.Space[Any]:
    """Make the space that `describe` has told of.

    Args:
        told: the description.
        what: the space is of, for messages.

    Returns:
        The space.

    Raises:
        ValueError: for anything else.
    """
    try:
        kind = validate.choice(f"kind of {what}", told["kind"], KINDS)
        if kind == "dict":
            parts = [(str(name), restore(each, f"{what} {name!r}")) for name, each in told["spaces"]]
            return spaces.Dict(OrderedDict(parts))  # a dict would be sorted, and a network reads them in their order
        shape = tuple(validate.integer(f"size of {what}", each, 0, LARGEST) for each in told["shape"])
        count = validate.integer(f"numbers of {what}", int(np.prod(shape)), 1, LARGEST)
        if kind == "binary":
            return spaces.MultiBinary(shape[0] if len(shape) == 1 else shape)
        dtype = np.dtype(validate.choice(f"dtype of {what}", told["dtype"], DTYPES))
        low, high = (_long(told[name], count, dtype).reshape(shape) for name in ("low", "high"))
        return spaces.Box(low, high, shape, dtype=dtype.type)
    except (TypeError, KeyError, OverflowError, AssertionError, RecursionError) as error:
        raise ValueError(f"the space of {what} is not told as it should be: {error!r}") from error


def _short(bound: NDArray[Any]) -> Any:
    """The numbers of a bound, or the one that all of them are."""
    first = bound.flat[0]
    return first.item() if (bound == first).all() else bound.ravel().tolist()


def _long(bound: Any, count: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    return np.broadcast_to(np.asarray(bound, dtype=dtype), (count,)).copy()
