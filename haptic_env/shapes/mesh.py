"""Any object, from a file of triangles (STL, OBJ or PLY).

The truth is the union of the file's closed surfaces, exactly; the physics sees convex pieces that differ from it by
a hundredth of its size at most. A file's own unit may be any: a size in metres says how large the object is.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import extras
from haptic_env.composer import mjcf
from haptic_env.shapes.base import LARGEST, SMALLEST, Shape
from haptic_env.shapes.pieces import convex_pieces, distance_from

SUFFIXES = (".stl", ".obj", ".ply")
CONVEX = 0.006  # of the largest extent: how far its hull may stick out of a part that is taken for convex
FLAT = 1e-6  # of its bounding box: less volume is none
UNITS = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254}


def is_path(name: str | Path) -> bool:
    """Whether `name` is that of a mesh file rather than of a shape."""
    return Path(name).suffix.lower() in SUFFIXES


def load(name: str) -> Mesh:
    """The shape in the file `name`; raises `ValueError`, naming the file, where it is not a closed solid."""
    path = Path(name)
    try:
        told = path.stat()
    except OSError as error:
        raise ValueError(f"mesh {name!r} cannot be read: {error.strerror or error}") from error
    return _load(str(path.resolve()), told.st_mtime_ns, told.st_size)


@lru_cache(maxsize=32)
def _load(path: str, *_: int) -> Mesh:
    """Once for as long as the file does not change."""
    return Mesh(path)


class Mesh(Shape):
    """One solid at any size; its frame has its origin at `centre` (3,), in the file's frame and unit."""

    def __init__(self, path: str) -> None:
        trimesh = extras.load("trimesh", "meshes", f"the shape {path!r}")
        try:
            surface = trimesh.load_scene(path).to_mesh()
        except Exception as error:  # whatever a broken file makes of a reader
            kind = Path(path).suffix[1:].upper()
            raise ValueError(f"mesh {path!r} cannot be read, it is no {kind} or was cut short: {error}") from error
        self.path = path
        self._parts = _closed_parts(path, surface)
        self._surface = trimesh.boolean.union(self._parts) if len(self._parts) > 1 else self._parts[0]
        self.extents = self._surface.extents
        self.centre = self._surface.bounds.mean(axis=0)

    def size(self, scale: float = 1.0) -> NDArray[np.float64]:
        """Full extents (3,) m, where the file's unit is `scale` metres; raises `ValueError` where nobody could hold
        that."""
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
        ratio = extents / self.extents
        if np.ptp(ratio) > 1e-6 * ratio[0]:
            valid = (ratio[0] * self.extents).round(6).tolist()
            raise ValueError(f"mesh {self.path!r} is only scaled as a whole, e.g. to {valid} m, got {extents.tolist()}")
        return extents

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        scale = size[0] / self.extents[0]
        there = np.asarray(points, dtype=np.float64) / scale + self.centre
        distance = distance_from(self._surface.vertices, self._surface.faces, there.reshape(-1, 3))
        return scale * distance.reshape(there.shape[:-1])

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        scale = size[0] / self.extents[0]
        meshes = [
            root.asset.add("mesh", name=f"piece{number}", vertex=np.ravel(scale * (vertices - self.centre)))
            for number, vertices in enumerate(self._pieces)
        ]
        return [{"type": "mesh", "mesh": mesh} for mesh in meshes]

    @cached_property
    def _pieces(self) -> list[NDArray[np.float64]]:
        """Corners (M, 3) of each convex piece, in the file's frame and unit."""
        tolerance = CONVEX * float(self.extents.max())
        return [piece for part in self._parts for piece in convex_pieces(part, tolerance)]


def _fits(extents: NDArray[np.float64]) -> bool:
    return bool((extents >= SMALLEST).all() and (extents <= LARGEST).all())


def _closed_parts(path: str, surface: Any) -> list[Any]:
    """The parts of `surface`, each a closed solid; raises `ValueError` where one has a hole or no inside."""

    def refused(why: str) -> ValueError:
        return ValueError(f"mesh {path!r} {why}")

    if len(surface.faces) == 0:
        raise refused("has no triangles: it is empty, or was cut short")
    if not np.isfinite(surface.vertices).all():
        raise refused("has corners that are not finite")
    surface.merge_vertices(merge_tex=True, merge_norm=True)
    parts = list(surface.split(only_watertight=False, repair=False))
    for part in parts:
        if not part.is_watertight:
            open_edges = int((np.bincount(part.faces_unique_edges.ravel()) != 2).sum())
            raise refused(f"is not watertight: {open_edges} edges do not join two triangles; close its holes")
        box = float(np.prod(part.extents))
        if box == 0 or abs(part.volume) < FLAT * box:
            raise refused(f"has no volume: a part of it is flat, {part.extents.tolist()} wide")
        if not part.is_winding_consistent or part.volume < 0:
            raise refused("is turned inside out or hollow: the triangles of a part of it do not all face outwards")
    return parts
