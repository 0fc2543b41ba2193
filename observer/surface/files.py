"""Files of surfaces, one writer a format: add one as a line in `WRITERS`.

What is written tells that it is a surface of this project (`MARK`), so that it is not taken for an object by mistake.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from haptic_env import validate
from haptic_env.files import atomic, check_writable
from haptic_env.shapes import triangles

if TYPE_CHECKING:
    from observer.surface.mesh import Surface

MARK = b"haptic-slam surface, metres"
HEAD, STL_HEAD = 1024, 80  # bytes within which it stands, and of an STL file's own head


def check(what: str, path: Path) -> Path:
    """Check that a surface can be written to a file, before any work is done for it.

    Args:
        what: tells of the file, for the error.
        path: of the file.

    Returns:
        The path.

    Raises:
        ValueError: for an unknown format, and where it cannot be written.
    """
    format_of(what, path)
    check_writable(what, path)
    return path


def format_of(what: str, path: Path) -> str:
    """Tell the format of a file by its name.

    Args:
        what: tells of the file, for the error.
        path: of the file.

    Returns:
        A key of `WRITERS`.

    Raises:
        ValueError: for a format that is not known, listing those that are.
    """
    ending = path.suffix.lower()
    if ending not in WRITERS:
        raise ValueError(
            f"{what} must be a file of a format that is known, {', '.join(WRITERS)}, got {validate.shown(str(path))}"
        )
    return ending


def save(surface: Surface, path: str | os.PathLike[str]) -> None:
    """Write a surface.

    Args:
        surface: not empty.
        path: of the file, whose name says the format.

    Raises:
        ValueError: for an unknown format, where it cannot be written, and for an empty surface.
        ImportError: where the extra `meshes` is missing.
    """
    place = check("path of a surface", validate.path("path of a surface", path))
    if surface.empty:
        raise ValueError(f"the surface is empty, as nothing was touched: nothing is written to {str(place)!r}")
    content = WRITERS[place.suffix.lower()](surface)
    with atomic(place) as unfinished:
        unfinished.write_bytes(content)


def is_ours(path: Path) -> bool:
    """Tell whether a file is a surface that was written here.

    Args:
        path: of a file.

    Returns:
        Whether it is.
    """
    try:
        with path.open("rb") as file:
            return MARK in file.read(HEAD)
    except OSError:
        return False


def _ply(surface: Surface) -> bytes:
    content = triangles.encoded(surface.mesh, "ply", {"std": surface.std}, vertex_normal=False)
    first, kind, rest = content.split(b"\n", 2)
    return b"\n".join([first, kind, b"comment " + MARK + b"; std: SD of each vertex", rest])


def _stl(surface: Surface) -> bytes:
    content = triangles.encoded(surface.mesh, "stl", {})
    return MARK.ljust(STL_HEAD) + content[STL_HEAD:]


def _obj(surface: Surface) -> bytes:
    return triangles.encoded(surface.mesh, "obj", {}, header=MARK.decode(), include_normals=False)


def _glb(surface: Surface) -> bytes:
    return triangles.encoded(surface.mesh, "glb", {"_STD": surface.std})


def _xyz(surface: Surface) -> bytes:
    rows = np.column_stack([surface.vertices, surface.std])
    lines = [f"{x:.6f} {y:.6f} {z:.6f} {std:.6f}" for x, y, z, std in rows]
    return "\n".join([f"# {MARK.decode()}: x y z std", *lines, ""]).encode()


WRITERS: dict[str, Callable[[Surface], bytes]] = {".ply": _ply, ".stl": _stl, ".obj": _obj, ".glb": _glb, ".xyz": _xyz}
