"""Any object, from a file of triangles (STL, OBJ or PLY).

The truth is the union of the file's closed surfaces, exactly; the physics sees convex pieces that differ from it by
a hundredth of its size at most. A file's own unit may be any: a size in metres says how large the object is.
"""

from __future__ import annotations

import copy
import hashlib
import os
import re
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import extras, mesh_formats, validate
from haptic_env.composer import mjcf
from haptic_env.shapes import names
from haptic_env.shapes.base import LARGEST, SMALLEST, Shape
from haptic_env.shapes.closed import closed_parts, union
from haptic_env.shapes.pieces import convex_pieces, distance_from, felt, inside_of
from haptic_env.shapes.proportions import check_kept

SUFFIXES = tuple(mesh_formats.READERS)
CONVEX = 0.006  # of the largest extent: how far its hull may stick out of a part that is taken for convex
DEEP = 0.01  # of the largest extent: farther from the surface, needles of triangles do not upset its winding
UNITS = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254}
SCALE = "scale"
KEPT = 128  # meshes of a process: more than there are candidates
WITH_BRACKETS = re.compile(rf"(.*(?:{'|'.join(map(re.escape, SUFFIXES))}))\s*(\(.*\))\s*", re.DOTALL | re.IGNORECASE)


def parted(name: str | Path) -> tuple[str, str]:
    """Take the name of a mesh apart.

    Args:
        name: path of the file, which may be followed by its scale or its size in brackets: "mug.stl(scale=0.001)".

    Returns:
        The path, and the brackets; "" where there are none.
    """
    text = str(name)
    found = WITH_BRACKETS.fullmatch(text) if text.endswith(")") else None
    return (found[1], found[2]) if found else (text, "")


def is_path(name: str | Path) -> bool:
    """Tell whether a name is that of a mesh file rather than of a shape.

    Args:
        name: of either.

    Returns:
        Whether it is.
    """
    return Path(parted(name)[0]).suffix.lower() in SUFFIXES


def place_of(path: str) -> Path:
    """Find a file that a name says.

    Args:
        path: of the file; ~ is the home folder, unless there is a file of just that name.

    Returns:
        Its place, whether or not there is one.
    """
    return Path(path if os.path.exists(path) else os.path.expanduser(path))


def written(name: str | Path) -> str:
    """Write the name of a mesh the one way in which it is always written.

    Args:
        name: as `parted` takes it.

    Returns:
        The name.
    """
    path, brackets = parted(name)
    said = names.parsed(f"mesh{brackets}") if brackets else None
    return f"{path}{str(said).removeprefix('mesh')}" if said else str(name)


def load(name: str) -> Mesh:
    """Read the shape in a mesh file.

    Args:
        name: path of the file, ~ being the home folder; brackets after it may say its scale, metres that its unit is
            long, or its size, metres of its largest extent or of all three.

    Returns:
        The shape; for one name always the same object, for as long as the file does not change.

    Raises:
        ValueError: where it is not a closed solid; it names the file.
    """
    name, brackets = parted(name)
    try:
        path = place_of(name).resolve()
        told = path.stat()
    except (OSError, ValueError, RuntimeError) as error:  # the latter: a NUL in a name, links that go round
        why = error.strerror if isinstance(error, OSError) else None
        raise ValueError(f"mesh {name!r} cannot be read: {why or error}") from error
    return _load(str(path), brackets, told.st_mtime_ns, told.st_size)


@lru_cache(maxsize=KEPT)
def _load(path: str, brackets: str, *version: int) -> Mesh:
    """Once for as long as the file does not change."""
    return _load(path, "", *version).scaled(brackets) if brackets else Mesh(path)


class Mesh(Shape):
    """One solid at any size; its frame has its origin at `centre` (3,), in the file's frame and unit."""

    def __init__(self, path: str) -> None:
        """Read the file.

        Args:
            path: of the file.

        Raises:
            ValueError: where it is not a closed solid.
        """
        extras.folder("trimesh", "meshes", f"the shape {path!r}")
        self.path = path
        try:
            vertices, triangles = mesh_formats.read(Path(path))
            self._parts = closed_parts(vertices, triangles)
            self._surface = union(self._parts)
        except OSError as error:
            raise self._refused(f"cannot be read: {error.strerror or error}") from error
        except ValueError as error:
            raise self._refused(str(error)) from error
        self.extents = self._surface.extents
        self.centre = self._surface.bounds.mean(axis=0)
        self._scale: float | None = None

    def __repr__(self) -> str:
        return f"<Mesh {self.path!r}>"

    @property
    def surface(self) -> Any:
        """The union of the file's parts: a trimesh, in the file's frame and unit; not to be changed."""
        return self._surface

    def scaled(self, brackets: str) -> Mesh:
        """Give the same surface another default size.

        Args:
            brackets: "(scale=0.001)", or "(size=0.1)".

        Returns:
            The mesh, of its own scale whatever is said of others.

        Raises:
            ValueError: for other brackets, or a size that nobody could hold.
        """
        said = names.parsed(f"mesh{brackets}")
        told = dict(said.keywords) if said else {}
        if said is None or said.values or len(told) != 1 or not {*told} <= {SCALE, names.SIZE}:
            raise self._refused(f"takes one of (scale=metres) and (size=metres) in brackets, got {brackets}")
        other = copy.copy(self)
        if SCALE in told:
            other._scale = validate.number(f"scale of mesh {self.path!r}", told[SCALE], above=0.0, unit="m")
            other.size()
            return other
        size = told[names.SIZE]
        extents = self.extents * (size / self.extents.max()) if isinstance(size, int | float) else size
        try:
            other._scale = float(self.check_size(extents)[0] / self.extents[0])
        except ValueError as error:
            raise self._refused(f"has a size that is not possible: {error}") from error
        return other

    def scale(self, usual: float = 1.0) -> float:
        """Give the scale of the file.

        Args:
            usual: metres that its unit is long where its name says nothing.

        Returns:
            The same of this one.
        """
        return usual if self._scale is None else self._scale

    def size(self, scale: float = 1.0) -> NDArray[np.float64]:
        """Give the full extents as the file has them.

        Args:
            scale: metres that the file's unit is long, unless its name says that.

        Returns:
            (3,) m.

        Raises:
            ValueError: where nobody could hold that.
        """
        scale = self.scale(scale)
        extents = self.extents * scale
        if _fits(extents):
            return extents
        fits = [f"scale={unit:g} ({name})" for name, unit in UNITS.items() if _fits(self.extents * unit)]
        hint = f"; if its unit is not {scale:g} m, say so: {' or '.join(fits)}" if fits else ""
        wide = " × ".join(f"{extent:.4g}" for extent in extents)
        raise ValueError(f"mesh {self.path!r} is {wide} m wide, objects are {SMALLEST:g} to {LARGEST:g} m{hint}")

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        if size is None:
            return self.size()
        extents = super().check_size(size)
        check_kept(f"mesh {self.path!r}", extents, self.extents)
        return extents

    @cached_property
    def content(self) -> str:
        """A digest of the surface, whatever the file is called."""
        corners, faces = np.asarray(self._surface.vertices), np.asarray(self._surface.faces)
        return f"mesh {hashlib.sha256(corners.tobytes() + faces.tobytes()).hexdigest()}"

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        scale = size[0] / self.extents[0]
        there = np.asarray(points, dtype=np.float64) / scale + self.centre
        surface = self._surface.vertices, self._surface.faces
        distance = distance_from(*surface, there.reshape(-1, 3))
        deep = np.flatnonzero(np.abs(distance) > DEEP * self.extents.max())
        inside = inside_of(*surface, there.reshape(-1, 3)[deep])
        distance[deep] = np.where(inside, -1.0, 1.0) * np.abs(distance[deep])
        return scale * distance.reshape(there.shape[:-1])

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        scale = size[0] / self.extents[0]
        meshes = [
            root.asset.add("mesh", name=f"piece{number}", vertex=np.ravel(scale * (vertices - self.centre)))
            for number, vertices in enumerate(self._pieces)
        ]
        return [{"type": "mesh", "mesh": mesh} for mesh in meshes]

    def prepare(self) -> None:
        self._pieces  # noqa: B018

    @cached_property
    def _pieces(self) -> list[NDArray[np.float64]]:
        """Corners (M, 3) of each convex piece, in the file's frame and unit."""
        width = float(self.extents.max())
        try:
            pieces = [piece for part in self._parts for piece in convex_pieces(part, CONVEX * width)]
        except ValueError as error:
            raise self._refused(str(error)) from error
        return felt(pieces, width)

    def _refused(self, why: str) -> ValueError:
        return ValueError(f"mesh {self.path!r} {why}")


def _fits(extents: NDArray[np.float64]) -> bool:
    return bool((extents >= SMALLEST).all() and (extents <= LARGEST).all())
