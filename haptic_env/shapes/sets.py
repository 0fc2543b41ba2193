"""Sets of objects: by name, in `SETS`, or in a TOML file that says their names, files, scales and sizes in one place.

    scale = 0.001                     # metres that the unit of its mesh files is long (default 1)
    [objects]
    mug = "meshes/mug.stl"            # a file, from the folder of this one
    egg = "ellipsoid(1, 1, 1.3)"      # or the name of a shape
    ball = { shape = "sphere", size = 0.06 }
    apple = { file = "apple.ply", scale = 0.01 }

or `objects = ["cube", "torus(0.4)", "meshes/mug.stl"]`. A set is a list of names like all others: that of an object in
a file is "daily.toml:mug", so that it is found again from any process, table and recording.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from haptic_env import reading, validate
from haptic_env.shapes import mesh, names

SETS: dict[str, tuple[str, ...]] = {
    "four": ("cube", "sphere", "pyramid", "cylinder"),
    "twelve": (
        *("cube", "sphere", "pyramid", "cylinder", "ellipsoid(1, 1, 1.6)", "cuboid(1, 1, 2)", "cone(1.5)"),
        *("torus(0.4)", "prism(3)", "L", "capsule", "noise(1)"),
    ),
    "twenty": (
        *("cube", "sphere", "pyramid", "cylinder", "ellipsoid(1, 1, 0.6)", "ellipsoid(1, 1, 1.6)"),
        *("cuboid(1, 1, 0.5)", "cuboid(1, 1, 2)", "cuboid(1, 1.5, 2)", "cone(1.5)", "frustum(0.5, 1)"),
        *("torus(0.3)", "torus(0.4)", "prism(3, 1)", "prism(6, 1)", "L(0.4, 0.6)", "L(0.25, 0.4)", "capsule(2)"),
        *("superquadric(0.3, 1)", "noise(1)"),
    ),
    "fifty": (
        *("cube", "sphere", "pyramid", "cylinder"),
        *(f"ellipsoid(1, {y}, {z})" for y, z in ((1, 0.6), (1, 1.6), (1, 2.2), (1.5, 2))),
        *(f"cuboid(1, {y}, {z})" for y, z in ((1, 0.5), (1, 2), (1.5, 2), (2, 3))),
        *(f"cone({height})" for height in (0.7, 1, 1.5)),
        *(f"frustum({top}, {height})" for top, height in ((0.5, 1), (0.7, 1.5))),
        *(f"torus({tube})" for tube in (0.3, 0.4, 0.48)),
        *(f"prism({sides}, {height})" for sides, height in ((3, 1), (3, 2), (4, 0.5), (5, 1), (6, 1), (8, 0.6))),
        *(f"L({bar}, {height})" for bar, height in ((0.4, 0.6), (0.3, 0.6), (0.5, 1), (0.25, 0.4))),
        *(f"capsule({length})" for length in (1.5, 2, 3)),
        *(f"superquadric({up}, {around})" for up, around in ((0.5, 0.5), (0.3, 1), (1, 0.3), (1.5, 0.5), (1.5, 1.5))),
        *(f"noise({seed})" for seed in range(1, 10)),
        *(f"noise({seed}, 0.25)" for seed in range(10, 13)),
    ),
}
SUFFIX = ".toml"
KEYS, OF_OBJECT = ("objects", "scale"), ("file", "scale", "shape", "size")
LABEL = re.compile(r"\w[\w +-]{0,59}")
MOST = 10_000  # objects of a file


def read(name: str | Path) -> tuple[str, ...]:
    """Read a set of objects.

    Args:
        name: of `SETS`, or the path of a TOML file, ~ being the home folder.

    Returns:
        The names of its objects, as `haptic_env.shapes.find`, environments and `ShapePosterior` take them.

    Raises:
        ValueError: for an unknown set, or a file that cannot be read as one; whether its objects can be explored is
            asked when they are found.
    """
    if not isinstance(name, str | Path) or Path(name).suffix.lower() != SUFFIX:
        try:
            return SETS[validate.choice("set of objects", name, SETS)]
        except ValueError as error:
            raise ValueError(f"{error}, or the path of a {SUFFIX} file") from None
    return tuple(_contents(str(name)))


def is_member(name: str) -> bool:
    """Tell whether a name is that of an object in a file of `read`.

    Args:
        name: any text.

    Returns:
        Whether it is "FILE.toml:OBJECT".
    """
    return _parted(name)[0].lower().endswith(SUFFIX)


def title(name: str) -> str:
    """Give the short name of an object in a file of `read`.

    Args:
        name: "FILE.toml:OBJECT".

    Returns:
        OBJECT.
    """
    return _parted(name)[1]


def meaning(name: str) -> str:
    """Say what an object in a file of `read` is.

    Args:
        name: "FILE.toml:OBJECT".

    Returns:
        The name of its shape, or the path of its mesh, with the scale or size that the file says.

    Raises:
        ValueError: as `read`, and where the file has no such object.
    """
    path, label = _parted(name)
    held = _contents(path)
    if name not in held:
        validate.choice(f"object of {path}", label, [title(each) for each in held if is_member(each)])
    return held[name]


def _parted(name: str) -> tuple[str, str]:
    path, _, label = name.rpartition(":")
    return path, label


def _contents(name: str) -> dict[str, str]:
    """What each object of a file is, by the name by which it is found."""
    path = mesh.place_of(name)
    try:
        told = path.stat()
        return _read(name, str(path.absolute()), told.st_mtime_ns, told.st_size)
    except OSError as error:
        raise ValueError(f"set of objects {name!r} cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise ValueError(f"set of objects {name!r}: {error}") from error


@lru_cache(maxsize=16)
def _read(name: str, path: str, *_: int) -> dict[str, str]:
    """Once for as long as the file does not change."""
    content, folder = reading.toml(path), Path(path).parent
    for key in content:
        validate.choice("key", key, KEYS)
    scale = validate.number("scale", content.get("scale", 1.0), above=0.0, unit="m")
    given = content.get("objects")
    if not isinstance(given, dict | list) or not given or len(given) > MOST:
        raise ValueError(
            'it must have a table of objects, as in: [objects] mug = "mug.stl", or a list, objects = ["cube", '
            f'"mug.stl"], of 1 to {MOST}, got {validate.shown(given)}'
        )
    entries = given.items() if isinstance(given, dict) else [(_label(each), each) for each in given]
    made: dict[str, str] = {}
    for label, each in entries:
        if not LABEL.fullmatch(label) and isinstance(given, dict):
            told = validate.shown(label)
            raise ValueError(f"an object's name must be of 1 to 60 letters, digits, spaces, +, - and _, got {told}")
        if label == names.NONE:
            raise ValueError(
                f"an object's name must not be {label!r}, which is said of one that is none of the candidates"
            )
        said = each if isinstance(each, Mapping) else {"shape": each}
        try:
            what = _object(said, scale, folder)
        except ValueError as error:
            raise ValueError(f"object {label!r}: {error}") from error
        # What a list names by its shape alone has no other name.
        own = f"{name}:{label}" if isinstance(given, dict) or mesh.is_path(what) else what
        if own in made:
            raise ValueError(f"each object must be there once, got {label!r} twice")
        made[own] = what
    return made


def _label(each: Any) -> str:
    """What an object of a list is called."""
    if not isinstance(each, str):
        raise ValueError(f"a list of objects has names of shapes and paths of meshes, got {validate.shown(each)}")
    return re.sub(r"[^\w +-]", "_", Path(mesh.parted(each)[0]).stem) if mesh.is_path(each) else each


def _object(said: Mapping[str, Any], scale: float, folder: Path) -> str:
    """The name of a shape or mesh that the table of an object says."""
    for key in said:
        validate.choice("key", key, OF_OBJECT)
    if ("file" in said) == ("shape" in said):
        raise ValueError(f"say either shape or file, got {', '.join(said) or 'neither'}")
    what = said.get("shape", said.get("file"))
    if not isinstance(what, str) or not what.strip() or is_member(what):
        raise ValueError(
            f"shape and file must be the name of a shape or the path of a mesh, got {validate.shown(what)}"
        )
    if "file" in said and not mesh.is_path(what):
        raise ValueError(f"file must be the path of a mesh ({', '.join(mesh.SUFFIXES)}), got {validate.shown(what)}")
    told = {key: _numbers(key, said[key]) for key in ("scale", "size") if key in said}
    if len(told) > 1:
        raise ValueError("say either size or scale")
    if mesh.is_path(what):
        path, brackets = mesh.parted(what)
        if told and brackets:
            raise ValueError(f"say size or scale once, got {validate.shown(what)} and {', '.join(told)}")
        said_so = brackets or _bracketed(told or {"scale": scale})
        return mesh.written(f"{folder / os.path.expanduser(path)}{said_so}")
    if "scale" in told:
        raise ValueError(f"scale is of mesh files, and {validate.shown(what)} is none: say its size")
    parsed = names.parsed(what) or names.Name(what.strip(), (), ())
    if told and names.SIZE in dict(parsed.keywords):
        raise ValueError(f"say size once, got {validate.shown(what)} and size")
    return str(parsed._replace(keywords=(*parsed.keywords, *told.items())))


def _numbers(key: str, value: Any) -> Any:
    """A number, or three of a size."""
    if key == "size" and isinstance(value, list):
        return tuple(validate.array("size", value, (3,), "m").tolist())
    return validate.number(key, value, above=0.0, unit="m")


def _bracketed(told: Mapping[str, Any]) -> str:
    return str(names.Name("", (), tuple(told.items())))
