"""Files of meshes, one module a format: add one as a file here and a line in `READERS`.

A reader takes the bytes of a file and nothing else: no file is opened that the first one names. What a file declares is
held against its size before room is made for it. `ValueError` says why it cannot be read, `Refused` why it is not
taken. Nothing that computes is loaded, so that a wrong file is told at once.
"""

from __future__ import annotations

import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from haptic_env.mesh_formats import obj, ply, stl
from haptic_env.mesh_formats.polygons import Polygons, Refused, triangulate

READERS: dict[str, Callable[[bytes], Polygons]] = {".stl": stl.read, ".obj": obj.read, ".ply": ply.read}
LARGEST = 200_000_000  # bytes: as many triangles as are taken, written as text with colours and normals
WIDTH = 1e-6, 1e9  # in the unit of the file; corners closer than 1e-8 of it are one
AWAY = 1e5  # widths from the origin, where numbers are still exact enough

__all__ = ["READERS", "Refused", "read"]


def read(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read a mesh file.

    Args:
        path: of the file.

    Returns:
        Corners (V, 3), in the unit of the file, and triangles (F, 3).

    Raises:
        OSError: where it cannot be opened.
        ValueError: where it cannot be read as what its name ends in; in words that go on from the file's name.
        Refused: where what it holds is not taken; likewise.
    """
    told = path.stat()
    if not stat.S_ISREG(told.st_mode):
        raise Refused("is no file")
    if told.st_size > LARGEST:
        raise Refused(f"has {told.st_size:,} bytes, at most {LARGEST:,} are taken: simplify it")
    suffix = path.suffix.lower()
    try:
        held = READERS[suffix](path.read_bytes())
        _check_corners(held.vertices, held.corners)
        triangles = triangulate(held)
    except Refused:
        raise
    except ValueError as error:
        raise ValueError(f"cannot be read, it is no {suffix[1:].upper()} or was cut short: {error}") from error
    if not len(triangles):
        raise Refused("has no triangles: it is empty, or was cut short")
    return held.vertices, triangles


def _check_corners(vertices: NDArray[np.float64], corners: NDArray[np.int64]) -> None:
    """Raise `ValueError` where faces join `corners` that are not there, `Refused` where those lie nowhere."""
    wrong = corners[(corners < 0) | (corners >= len(vertices))]
    if len(wrong):
        raise ValueError(f"a face names corner {wrong[0]} of {len(vertices)}, counted from 0")
    wrong = np.intersect1d(corners, np.flatnonzero(~np.isfinite(vertices).all(axis=1)))
    if len(wrong):
        raise Refused(f"has {len(wrong)} corners that are not finite, e.g. {vertices[wrong[0]].tolist()}")
    if len(corners):
        low, high = vertices[corners].min(axis=0), vertices[corners].max(axis=0)
        width, away = float((high - low).max()), float(np.abs([low, high]).max())
        if not WIDTH[0] <= width <= WIDTH[1]:
            raise Refused(f"is {width:g} wide, {WIDTH[0]:g} to {WIDTH[1]:g} are taken, in whatever unit")
        if away > AWAY * width:
            raise Refused(f"lies {away:g} from its origin and is {width:g} wide: move it to its origin")
