"""Libraries of objects that were felt: what is added to them, and files of theirs. V vertices, F faces."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from observer import Library
from observer.surface import Surface
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.files import archives, file, out
from tests.properties.parameters import array, name, one_of_these
from tests.properties.rule import Allowed

CORNERS = 0.02 * np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]], dtype=np.float64)
SIDES = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
FACES = (SIDES, SIDES[:3], SIDES + 1, SIDES.astype(float), None, "faces", np.zeros((0, 3), int))
SURFACE = Surface(CORNERS, SIDES, np.full(4, 0.002))
OBJECT = {**SURFACE._asdict(), "about": np.array('{"shape": "cube"}')}


def _added(name: Any = "mug", about: Any = None, **arrays: Any) -> Any:
    """What is kept of a surface."""
    folder = out("library")
    shutil.rmtree(folder, ignore_errors=True)
    library = Library(folder)
    library.add(name, SURFACE._replace(**arrays), about)
    assert len(library.candidates(samples.hand())) == 1
    return library[library.names[0]].surface


def _names(path: Any) -> Any:
    return Library(path).names


def _read(path: Path) -> Any:
    """An object of which the file is odd."""
    folder = path.parent / "library"
    folder.mkdir()
    path.replace(folder / "input.npz")
    return Library(folder)["input"].surface


ENTRIES: dict[str, Entry] = {
    "observer.Library.add": Entry(
        _added,
        {
            "name": name(["mug1", "key 2"]).always,
            "vertices": array((4, 3), -0.02, 0.02),
            "std": array((4,), 0.0, 0.01),
            "faces": one_of_these(
                SIDES, SIDES[:3], SIDES + 1, SIDES.astype(float), None, "faces", np.zeros((0, 3), int)
            ),
            "about": one_of_these({}, {"a": 1}, {"a": np.nan}, {"a": object()}, {1: 2}, {"x": "y" * 10**5}),
        },
        Allowed(words=("surface", "what was felt", "object", "extent", "vertices", "faces", "about", "std", "edges")),
        weight=0.3,
    ),
    "observer.Library": Entry(
        lambda path: Library(path).names, {"path": file(".npz", b"").always}, Allowed(files=True)
    ),
    "observer.Library[file]": Entry(
        _read,
        {"path": file(".npz", samples.npz(OBJECT), also=archives(OBJECT), there=True).always},
        Allowed(files=True, words=("input",)),
        weight=0.3,
    ),
}
