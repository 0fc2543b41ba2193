"""The registry of shapes: add one as a file here and a line in `SHAPES`, or in `FAMILIES` where it has parameters.

Sets of objects are in `haptic_env.shapes.sets`.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import own, validate
from haptic_env.shapes import mesh, names, sets
from haptic_env.shapes.base import Shape, Solid
from haptic_env.shapes.capsule import Capsule
from haptic_env.shapes.cone import Cone
from haptic_env.shapes.cube import Cube
from haptic_env.shapes.cuboid import Cuboid
from haptic_env.shapes.cylinder import Cylinder
from haptic_env.shapes.ell import Ell
from haptic_env.shapes.ellipsoid import Ellipsoid
from haptic_env.shapes.frustum import Frustum
from haptic_env.shapes.noise import Noise
from haptic_env.shapes.prism import Prism
from haptic_env.shapes.pyramid import Pyramid
from haptic_env.shapes.sets import SETS
from haptic_env.shapes.sets import read as read_set
from haptic_env.shapes.sphere import Sphere
from haptic_env.shapes.superquadric import Superquadric
from haptic_env.shapes.torus import Torus

if TYPE_CHECKING:
    from haptic_env.hand import Hand

SHAPES: dict[str, Shape] = {
    "cube": Cube(),
    "sphere": Sphere(),
    "pyramid": Pyramid(),
    "cylinder": Cylinder(),
}
FAMILIES: names.Families = {
    "capsule": Capsule,
    "cone": Cone,
    "cuboid": Cuboid,
    "ellipsoid": Ellipsoid,
    "frustum": Frustum,
    "L": Ell,
    "noise": Noise,
    "prism": Prism,
    "superquadric": Superquadric,
    "torus": Torus,
}

__all__ = [
    "FAMILIES", "SETS", "SHAPES", "Shape", "Solid",
    "allow", "check", "default_size", "find", "make", "read_set", "usual",
]  # fmt: skip


def written(name: str) -> str:
    """Write a name the one way in which it is always written, whether or not there is such a shape.

    Args:
        name: as `check` takes it.

    Returns:
        The name.
    """
    if sets.is_member(name):
        return name
    return mesh.written(name) if mesh.is_path(name) else str(names.parsed(name) or name)


def allow(several: Iterable[str]) -> None:
    """Import the modules of classes of a user's own among names of shapes, which runs what is in them.

    Args:
        several: names that the user has typed or trusts.

    Raises:
        ValueError: for one that is no text or cannot be imported, or an object that is not in its set.
    """
    for name in several:
        validate.instance("name of a shape", name, (str, Path), "a text or a path")
        meant = sets.meaning(str(name)) if sets.is_member(str(name)) else str(name)
        said = names.parsed(meant)
        if said is not None and own.is_named(said.family):
            own.load("shape", said.family)


def origin(name: str) -> bytes:
    """Give what a file says of a shape, to tell it from another one of that name.

    Args:
        name: as `check` takes it, of a shape that is there.

    Returns:
        The content of its mesh file, and what a set says of it; nothing where its name says all.

    Raises:
        OSError: where a file cannot be read.
        ValueError: for an object that is not in its set.
    """
    meant = sets.meaning(name) if sets.is_member(name) else name
    if mesh.is_path(meant):
        path, brackets = mesh.parted(meant)
        content = mesh.place_of(path).read_bytes()
        return content + brackets.encode() if meant != name else content
    return meant.encode() if meant != name else b""


def _made(name: Any) -> tuple[str, Shape] | None:
    """The name and the shape of a solid of a family, or with its size in brackets; None for any other name."""
    if not isinstance(name, str):
        return None
    parsed = names.parsed(name)
    said = parsed or names.Name(name.strip(), (), ())
    if own.is_named(said.family):
        mine = names.make(said, own.find("shape", said.family, Shape))  # type: ignore[type-abstract]
        mine.check_size(None)
        return str(said), mine
    if said.family in FAMILIES:
        return str(said), names.make(said, FAMILIES[said.family])
    if parsed is not None and said.family in SHAPES:
        shape = SHAPES[said.family]
        return str(said), names.make(said, type(shape)) if said.values or said.keywords else shape
    return None


def _resolved(what: str, name: Any) -> tuple[str, Shape]:
    """The name of a shape, as it is always written, and the shape; raises as `check`."""
    if isinstance(name, str | Path) and sets.is_member(str(name)):
        name = str(name)
        meant = sets.meaning(name)
        try:
            return name, _resolved(what, meant)[1]
        except ValueError as error:
            raise ValueError(f"{what} {name!r}: {error}") from error
    if isinstance(name, str | Path) and mesh.is_path(name):
        return mesh.written(name), mesh.load(str(name))
    made = _made(name)
    if made is not None:
        return made
    try:
        return name, SHAPES[validate.choice(what, name, SHAPES)]
    except ValueError as error:
        families = ", ".join(names.signature(each, FAMILIES[each]) for each in FAMILIES)
        raise ValueError(
            f"{error}, or {families}, or the path of a mesh ({', '.join(mesh.SUFFIXES)}), an object of a set "
            "(daily.toml:mug), a class of one's own (module:Class)"
        ) from None


def check(what: str, name: Any) -> str:
    """Check that a shape can be explored.

    Args:
        what: `name` is of, for messages.
        name: of a shape, one with proportions or a size in brackets ("ellipsoid(1, 1, 1.3)", "cube(size=0.04)"), the
            path of a mesh ("mug.stl", "mug.stl(scale=0.001)"), an object of a set ("daily.toml:mug"), or a class of
            one's own in a module that is imported ("mypackage.shapes:Egg").

    Returns:
        The name, always written the same way.

    Raises:
        ValueError: where it is neither, a parameter is out of range, or the mesh cannot be explored.
    """
    return _resolved(what, name)[0]


def find(name: str) -> Shape:
    """Find a shape.

    Args:
        name: of a shape, with brackets or without, or the path of a mesh.

    Returns:
        The shape; for one name always the same object.

    Raises:
        ValueError: where there is none.
    """
    return _resolved("shape", name)[1]


def default_size(name: str, scale: float = 1.0) -> NDArray[np.float64]:
    """Give the size of a shape where nothing else is said.

    Args:
        name: as `check` takes it.
        scale: metres that the unit of a mesh file is long.

    Returns:
        (3,) m, full extents.

    Raises:
        ValueError: for an unknown name, or a mesh that nobody could hold.
    """
    scale = validate.number("scale", scale, above=0.0, unit="m")
    shape = find(name)
    return shape.size(scale) if isinstance(shape, mesh.Mesh) else np.asarray(shape.default_size)


def usual(name: str, hand: Hand, scale: float = 1.0) -> Solid:
    """Make a solid of default size where a hand explores.

    Args:
        name: as `check` takes it.
        hand: that explores.
        scale: metres that the unit of a mesh file is long.

    Returns:
        The solid.

    Raises:
        ValueError: as `default_size`.
    """
    size = default_size(name, scale)
    return make(name, size, hand.place(size))


def make(
    name: str | Path,
    size: ArrayLike | None = None,
    position: ArrayLike = (0.0, 0.0, 0.0),
    quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0),
) -> Solid:
    """Make a solid of a shape or mesh file.

    Args:
        name: as `check` takes it.
        size: (3,) m, full extents; None: its default.
        position: (3,) m, in the world.
        quaternion: (4,) wxyz, in the world.

    Returns:
        The solid.

    Raises:
        ValueError: for an unknown name, or a size or pose that is not possible.
    """
    name, shape = _resolved("shape", name)
    extents = shape.check_size(size)
    place = validate.place("object position", position)
    turn = validate.quaternion("object quaternion", quaternion)
    w, x, y, z = (turn / float((turn @ turn) ** 0.5)).tolist()
    return Solid(name, shape, tuple(extents.tolist()), tuple(place.tolist()), (w, x, y, z))
