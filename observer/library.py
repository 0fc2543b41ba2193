"""A library of objects that were felt: a folder with one file an object, `NAME.npz`, of plain arrays.

A file is there whole or not at all. One that was damaged since is told by its name; the others stay usable.
"""

from __future__ import annotations

import json
import os
import re
import warnings
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env import readable, reading, validate
from haptic_env.files import atomic, check_writable
from haptic_env.hand import Hand
from haptic_env.shapes.base import LARGEST, Solid
from haptic_env.shapes.names import NONE
from observer import edge
from observer.belief import Belief
from observer.surface import Surface
from observer.surface.felt_shape import FeltShape

ENDING = ".npz"
NAMES = r"[A-Za-z0-9](?:[A-Za-z0-9 ._-]{0,62}[A-Za-z0-9_-])?"
VALID = "1 to 64 ASCII letters, digits, spaces, dots, - and _, the first a letter or digit, the last no dot or space"
RESERVED = r"(?i:con|prn|aux|nul|com\d|lpt\d)(?:\..*)?"  # of Windows
LARGEST_FILE = 2**26  # bytes
MOST_TOLD = 2**14  # characters


class DamagedEntry(UserWarning):
    """An object of a library that cannot be read, and is left out."""


class FeltObject(NamedTuple):
    """An object of a library.

    Attributes:
        surface: that was felt, and how surely; metres, its origin at the middle of its bounding box.
        about: what is told of it: where it was learnt, say.
    """

    surface: Surface
    about: Mapping[str, Any]

    def __repr__(self) -> str:
        return readable.line(self)


class Library(Mapping[str, FeltObject]):
    """Objects by the names that they were given; what other programs add meanwhile is there at once.

    Attributes:
        path: of the folder.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Open a library; its folder is made when the first object is added.

        Args:
            path: of the folder.

        Raises:
            ValueError: where something else is there.
        """
        self.path = validate.path("path of a library", path)
        if self.path.exists() and not self.path.is_dir():
            raise ValueError(f"a library must be a folder, got {validate.shown(str(path))}, which is something else")

    __repr__ = readable.line

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all objects, in order, those that cannot be read among them."""
        try:
            found = [each.name.removesuffix(ENDING) for each in self.path.iterdir() if each.suffix == ENDING]
        except (FileNotFoundError, NotADirectoryError):
            return ()
        return tuple(sorted(name for name in found if _possible(name)))

    @property
    def damaged(self) -> dict[str, str]:
        """Of each object that cannot be read, why."""
        return self.read()[1]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> FeltObject:
        """Read an object.

        Args:
            name: of it.

        Returns:
            The object.

        Raises:
            KeyError: where there is none of that name.
            ValueError: where it cannot be read.
        """
        return _read(self._found(name))

    def add(
        self, name: str, felt: Belief | Surface, about: Mapping[str, Any] | None = None, *, replace: bool = False
    ) -> None:
        """Add an object.

        Args:
            name: that it is called by.
            felt: the belief, with a map, after it was explored, or the surface of one.
            about: what else is told of it, as JSON can say.
            replace: whether one of that name gives way.

        Raises:
            ValueError: for a name that cannot be one or is taken, an object that was not touched, and where the folder
                cannot be written to.
            ImportError: where the extra `meshes` is missing.
        """
        self.check(name, replace=replace)
        validate.instance("felt", felt, (Belief, Surface), "a Belief, as an observer gives, or its surface()")
        surface = FeltShape(_checked(felt.surface() if isinstance(felt, Belief) else felt)).surface
        try:
            told = json.dumps(dict(about or {}), allow_nan=False)
        except (TypeError, ValueError) as error:
            raise ValueError(f"about must be what JSON can say, got {validate.shown(about)}: {error}") from error
        if len(told) > MOST_TOLD:
            raise ValueError(f"about must be of at most {MOST_TOLD} characters of JSON, got {len(told)}")
        self.path.mkdir(parents=True, exist_ok=True)
        with atomic(self._place(name)) as unfinished:
            arrays: dict[str, Any] = surface._asdict()
            np.savez_compressed(unfinished, **arrays, about=np.array(told))

    def check(self, name: str, *, replace: bool = False) -> None:
        """Check that an object can be added, before it is explored.

        Args:
            name: that it is to be called by.
            replace: whether one of that name gives way.

        Raises:
            ValueError: where it cannot be.
        """
        if not isinstance(name, str) or not _possible(name):
            raise ValueError(f"the name of an object must be {VALID}, and not {NONE!r}, got {validate.shown(name)}")
        taken = next((each for each in self.names if each.casefold() == name.casefold()), None)
        if taken is not None and not (replace and taken == name):
            why = "is there already" if taken == name else f"differs from {taken!r} in capitals alone"
            raise ValueError(f"{name!r} {why}, in the library {str(self.path)!r}; choose another name, or replace it")
        if taken is not None:
            _check_ours(self._place(name))
        there = next(each for each in (self.path, *self.path.absolute().parents) if each.exists())
        if there == self.path:
            check_writable("an object of a library", there / f"{name}{ENDING}")
            return
        if not there.is_dir():
            raise ValueError(f"the library {str(self.path)!r} cannot be made: {str(there)!r} is no folder")
        try:
            check_writable("a library", there / "new")
        except ValueError as error:
            told = f"the library {str(self.path)!r} cannot be made: {str(there)!r} cannot be written to"
            raise ValueError(told) from error

    def remove(self, name: str) -> None:
        """Remove an object, damaged ones too.

        Args:
            name: of it.

        Raises:
            KeyError: where there is none of that name.
            ValueError: for a file that never was an object of a library.
            OSError: where it cannot be read or removed.
        """
        place = self._found(name)
        _check_ours(place)
        place.unlink()

    def candidates(self, hand: Hand) -> dict[str, list[Solid]]:
        """List what `ShapePosterior` may choose from; what cannot be read is left out, with a `DamagedEntry`.

        Args:
            hand: that explores.

        Returns:
            Solids by name, each lying as it lay when it was felt, where the hand explores.

        Raises:
            ImportError: where the extra `meshes` is missing.
        """
        edge.world(hand=hand)
        whole, damaged = self.read()
        for why in damaged.values():
            warnings.warn(f"left out of the library: {why}", DamagedEntry, stacklevel=2)
        return {name: [FeltShape(each.surface).solid(name, hand)] for name, each in whole.items()}

    def read(self) -> tuple[dict[str, FeltObject], dict[str, str]]:
        """Read all objects, each once.

        Returns:
            Those that can be read by their names, and of each other one, why it cannot.
        """
        whole, damaged = {}, {}
        for name in self.names:
            try:
                whole[name] = _read(self._place(name))
            except (ValueError, OSError) as error:
                damaged[name] = str(error)
        return whole, damaged

    def _place(self, name: str) -> Path:
        return self.path / f"{name}{ENDING}"

    def _found(self, name: str) -> Path:
        """The file of an object; raises `KeyError` where there is none."""
        names = self.names
        if name not in names:
            told = f"it has {validate.listed(names)}" if names else "it is empty"
            raise KeyError(f"{validate.shown(name)} is not in the library {str(self.path)!r}; {told}")
        return self._place(name)


def _possible(name: str) -> bool:
    return bool(re.fullmatch(NAMES, name)) and not re.fullmatch(RESERVED, name) and name.casefold() != NONE


def _read(place: Path) -> FeltObject:
    """The object in a file; raises `ValueError` naming it where it is not whole."""
    content = reading.npz(place, LARGEST_FILE)
    _check_arrays(place, content)
    try:
        told = content["about"]
        about = json.loads(str(told)) if told.dtype.kind == "U" and told.ndim == 0 else None
        if not isinstance(about, dict):
            raise ValueError("what it tells about the object is no JSON table")
        surface = _checked(Surface(content["vertices"], content["faces"], content["std"]))
        return FeltObject(FeltShape(surface).surface, about)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{place}: not an object of a library ({error})") from error


def _check_arrays(place: Path, held: Iterable[str]) -> None:
    missing = {*Surface._fields, "about"} - {*held}
    if missing:
        raise ValueError(f"{place}: not an object of a library, it has no {', '.join(sorted(missing))}")


def _check_ours(place: Path) -> None:
    """Raise `ValueError` for what holds something else than an object; what is damaged may have been one."""
    if not place.is_file():
        raise ValueError(f"{place}: not an object of a library, it is no file")
    try:
        with zipfile.ZipFile(place) as file:
            held = [each.removesuffix(".npy") for each in file.namelist()]
    except OSError:
        raise
    except Exception:  # a damaged archive ends its reader in many ways
        return
    _check_arrays(place, held)


def _checked(surface: Surface) -> Surface:
    """A surface whose arrays fit together; raises `ValueError` for others."""
    vertices = validate.numbers("vertices", surface.vertices, bound=1e3)
    std = validate.numbers("std", surface.std, bound=LARGEST)
    faces: NDArray[Any] = np.asarray(surface.faces)
    count = len(vertices) if vertices.ndim else 0
    if vertices.shape != (count, 3) or std.shape != (count,) or (std < 0.0).any():
        raise ValueError(
            f"vertices (V, 3) and std (V,), not below 0, must go together, got {vertices.shape}, {std.shape}"
        )
    if faces.dtype.kind not in "iu" or faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"faces must be whole numbers (F, 3), got {faces.dtype} {faces.shape}")
    if faces.size and not (faces.min() >= 0 and faces.max() < count):
        raise ValueError(f"faces must be indices of {count} vertices, got {faces.min()} to {faces.max()}")
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    if (np.unique(edges, axis=0, return_counts=True)[1] % 2).any():
        raise ValueError("the surface must be closed: some of its edges do not join two faces")
    return Surface(vertices, faces.astype(np.int64), std)
