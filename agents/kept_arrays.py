"""Files of models: the arrays and a description in JSON of an .npz file, nothing that runs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from haptic_env import reading, validate

VERSION = 1
LARGEST = 256 * reading.MIB
Model = TypeVar("Model")


class KeptArrays:
    """The arrays of a file, each taken once, with the shape that it must have.

    Attributes:
        left: what was not taken yet, by name.
    """

    def __init__(self, found: Mapping[str, NDArray[Any]]) -> None:
        """Keep them.

        Args:
            found: by name.
        """
        self.left = dict(found)

    def take(self, name: str, *shape: int | None, dtype: type = np.float32) -> NDArray[Any]:
        """Take an array.

        Args:
            name: of it.
            *shape: that it must have; None: any.
            dtype: that it shall have.

        Returns:
            The array.

        Raises:
            ValueError: where there is none, or one of another shape, or not finite.
        """
        array = self.left.pop(name, None)
        if array is None:
            raise ValueError(f"it lacks {name!r}")
        fits = array.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
        if array.dtype.kind != "f" or not fits or not np.isfinite(array).all():
            wanted = tuple("any" if each is None else each for each in shape)
            raise ValueError(f"{name!r} must be finite numbers of shape {wanted}, got {array.dtype} {array.shape}")
        return array.astype(dtype)


def restored(
    path: Path, kinds: Mapping[str, Callable[[dict[str, Any], KeptArrays], Model]]
) -> tuple[Model, dict[str, Any]]:
    """Read a model from a file; runs nothing.

    Args:
        path: of the file.
        kinds: what makes a model of a description and arrays, by what the description says that it is.

    Returns:
        The model, and the description.

    Raises:
        ValueError: for a file of none of these, or not whole.
    """
    try:
        found = dict(reading.npz(path, LARGEST))
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error}") from error
    try:
        if "description" not in found:
            raise ValueError(f"it has no description; it holds {validate.listed(found) or 'nothing'}")
        told = json.loads(str(found.pop("description")))
        if not isinstance(told, dict) or told.get("kind") not in kinds or told.get("version") != VERSION:
            raise ValueError(f"its description is not of a {' or '.join(kinds)} of version {VERSION}")
        return kinds[told["kind"]](told, KeptArrays(found)), told
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        told_in_a_line = " ".join(str(error).split())
        raise ValueError(f"{path} is no policy that `agents.export` has written: {told_in_a_line}") from error
