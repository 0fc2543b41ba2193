"""Files of models: the arrays and a description in JSON of an .npz file, nothing that runs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents import spaces_json
from agents.instead import Instead
from haptic_env import reading, validate

VERSION = 1
LARGEST = 256 * reading.MIB
Model = TypeVar("Model")


class Kept(Protocol):
    """A model that is written to a file: what each kind of them has."""

    @property
    def observation_space(self) -> gym.Space[Any]:
        """Of what it sees."""

    @property
    def action_space(self) -> gym.spaces.Box:
        """Of what it does."""

    @property
    def told(self) -> Mapping[str, Any]:
        """How it was trained."""

    @property
    def instead(self) -> Instead | None:
        """What it is shown in place of what is observed."""


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


def write(
    path: Path, kind: str, model: Kept, description: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Write a model to a file, as `restored` reads it: numbers and a description, nothing that runs.

    Args:
        path: of the file.
        kind: of model.
        model: whose spaces, training and what it is shown instead are described.
        description: what else there is to say of it.
        arrays: of it, by name.
    """
    instead = model.instead
    told = {
        "kind": kind,
        "version": VERSION,
        "observation": spaces_json.describe(model.observation_space),
        "action": spaces_json.describe(model.action_space),
        **description,
        "told": dict(model.told),
        **({} if instead is None else {"instead": instead.columns.tolist()}),
    }
    shown = {} if instead is None else {"instead": instead.shown}
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays, **shown, description=np.array(json.dumps(told)))


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
