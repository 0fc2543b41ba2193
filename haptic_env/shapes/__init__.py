"""The registry of shapes: add one as a file here and a line in `SHAPES`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.shapes import mesh
from haptic_env.shapes.base import Shape, Solid
from haptic_env.shapes.cube import Cube
from haptic_env.shapes.cylinder import Cylinder
from haptic_env.shapes.pyramid import Pyramid
from haptic_env.shapes.sphere import Sphere

SHAPES: dict[str, Shape] = {
    "cube": Cube(),
    "sphere": Sphere(),
    "pyramid": Pyramid(),
    "cylinder": Cylinder(),
}

__all__ = ["SHAPES", "Shape", "Solid", "check", "default_size", "find", "make"]


def check(what: str, name: Any) -> str:
    """Check that a shape can be explored.

    Args:
        what: `name` is of, for messages.
        name: of a shape, or the path of a mesh.

    Returns:
        The name.

    Raises:
        ValueError: where it is neither, or the mesh cannot be explored.
    """
    if isinstance(name, str | Path) and mesh.is_path(name):
        mesh.load(str(name))
        return str(name)
    try:
        return validate.choice(what, name, SHAPES)
    except ValueError as error:
        raise ValueError(f"{error}, or the path of a mesh ({', '.join(mesh.SUFFIXES)})") from None


def find(name: str) -> Shape:
    """Find a shape.

    Args:
        name: of a shape, or the path of a mesh.

    Returns:
        The shape.

    Raises:
        ValueError: where there is none.
    """
    name = check("shape", name)
    return SHAPES[name] if name in SHAPES else mesh.load(name)


def default_size(name: str, scale: float = 1.0) -> NDArray[np.float64]:
    """Give the size of a shape where nothing else is said.

    Args:
        name: of a shape, or the path of a mesh.
        scale: metres that the unit of a mesh file is long.

    Returns:
        (3,) m, full extents.

    Raises:
        ValueError: for an unknown name, or a mesh that nobody could hold.
    """
    scale = validate.number("scale", scale, above=0.0, unit="m")
    shape = find(name)
    return shape.size(scale) if isinstance(shape, mesh.Mesh) else np.asarray(shape.default_size)


def make(
    name: str | Path,
    size: ArrayLike | None = None,
    position: ArrayLike = (0.0, 0.0, 0.0),
    quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0),
) -> Solid:
    """Make a solid of a shape or mesh file.

    Args:
        name: of a shape, or the path of a mesh.
        size: (3,) m, full extents; None: its default.
        position: (3,) m, in the world.
        quaternion: (4,) wxyz, in the world.

    Returns:
        The solid.

    Raises:
        ValueError: for an unknown name, or a size or pose that is not possible.
    """
    name = check("shape", name)
    shape = find(name)
    extents = shape.check_size(size)
    place = validate.place("object position", position)
    turn = validate.quaternion("object quaternion", quaternion)
    w, x, y, z = (turn / float((turn @ turn) ** 0.5)).tolist()
    return Solid(name, shape, tuple(extents.tolist()), tuple(place.tolist()), (w, x, y, z))
