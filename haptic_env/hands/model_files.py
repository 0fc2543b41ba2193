"""The models that hands of one's own are made of, read from MJCF and URDF files.

A file is read, and nothing in it is run: MuJoCo's plugins are refused. What it includes and the meshes that it names
are read if they are files of at most `LARGEST` bytes. Of a URDF the links, joints and what collides are read; pictures,
transmissions and what is meant for other simulators are left out.
"""

from __future__ import annotations

import logging
import stat
import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import mujoco
import numpy as np

from haptic_env import reading

LARGEST = 64 * reading.MIB
DEEPEST = 20  # includes within includes
NAMED = ("include", "mesh", "hfield", "skin", "texture")  # elements that name files
REFUSED = ("extension", "plugin")
MESHES = (".stl", ".obj", ".msh")  # what MuJoCo reads
NUMBERS = (
    "body_pos", "body_quat", "geom_pos", "geom_quat", "geom_size", "geom_aabb", "jnt_pos", "jnt_axis", "jnt_range",
)  # fmt: skip
URDF_KEPT = ("link", "joint", "material")
PACKAGE = "package://"


def load(path: Path, packages: Mapping[str, Path]) -> mujoco.MjModel:
    """Compile a model.

    Args:
        path: of the MJCF or URDF.
        packages: by the name of each ROS package that a URDF names, its folder.

    Returns:
        The model, its fixed bodies kept.

    Raises:
        ValueError: for a file that cannot be read, has plugins or does not compile; with MuJoCo's own words.
    """
    try:
        root = _parsed(path)
        with _quiet():
            return _finite(_spec(path, root, packages).compile())
    except OSError as error:
        place = error.filename or path
        raise ValueError(f"model {place} cannot be read: {error.strerror or error}") from error
    except (ValueError, RuntimeError, mujoco.FatalError) as error:  # MuJoCo's own are of several lines
        told = "; ".join(line.strip() for line in str(error).splitlines() if line.strip())
        raise ValueError(f"model {path}: {told}") from error


def _spec(path: Path, root: ElementTree.Element, packages: Mapping[str, Path]) -> mujoco.MjSpec:
    if root.tag == "robot":
        return mujoco.MjSpec.from_string(ElementTree.tostring(_prepared(path, root, packages), encoding="unicode"))
    if root.tag != "mujoco":
        raise ValueError(f"it begins with <{root.tag[:40]}>; a model is MJCF, <mujoco>, or URDF, <robot>")
    _check(path, root, path.parent, 0)
    return mujoco.MjSpec.from_file(str(path))


@contextmanager
def _quiet() -> Iterator[None]:
    """Without what MuJoCo says of masses, which are left out, and of NaN, which are refused."""
    logger = logging.getLogger("absl")
    level = logger.level
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        logger.setLevel(logging.ERROR)
        try:
            yield
        finally:
            logger.setLevel(level)


def _finite(model: mujoco.MjModel) -> mujoco.MjModel:
    for name in NUMBERS:
        if not np.isfinite(getattr(model, name)).all():
            raise ValueError(f"{name} has numbers that are not finite")
    return model


def _parsed(path: Path) -> ElementTree.Element:
    text = reading.text(_regular(path), LARGEST)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("it declares a document type, of which models have none")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"not XML ({error})") from error


def _regular(path: Path) -> Path:
    """`path`, unless it is a pipe or a device, or too large."""
    told = path.stat()
    if not stat.S_ISREG(told.st_mode):
        raise ValueError(f"{path} is no file")
    if told.st_size > LARGEST:
        raise ValueError(f"{path} is larger than {LARGEST // reading.MIB} MiB, which is the most that is read")
    return path


def _check(path: Path, root: ElementTree.Element, folder: Path, depth: int) -> None:
    """Raise `ValueError` for plugins, and for files that are none, in the MJCF at `path` and what it includes."""
    if depth > DEEPEST:
        raise ValueError(f"more than {DEEPEST} files include each other")
    for element in root.iter():
        if element.tag in REFUSED:
            raise ValueError(f"{path.name} has <{element.tag}>: plugins run code, and are refused; take it out")
    for name, place in _files(root, folder):
        if name == "include":
            _check(place, _parsed(place), folder, depth + 1)
        elif place.exists():  # where it is not, MuJoCo says so
            _regular(place)


def _files(root: ElementTree.Element, folder: Path) -> Iterator[tuple[str, Path]]:
    """The files that an MJCF names, and by which elements."""
    told: dict[str, str] = {}
    for compiler in root.iter("compiler"):
        told |= compiler.attrib
    below = {"mesh": told.get("meshdir"), "texture": told.get("texturedir")}
    for element in root.iter():
        if element.tag in NAMED and element.get("file"):
            inside = "" if element.tag == "include" else below.get(element.tag) or told.get("assetdir", "")
            yield element.tag, folder / inside / element.attrib["file"]


def _prepared(path: Path, root: ElementTree.Element, packages: Mapping[str, Path]) -> ElementTree.Element:
    """What MuJoCo reads of a URDF, with the paths of its meshes."""
    if any("xacro" in element.tag for element in root.iter()):
        raise ValueError("it is xacro, a program that makes a URDF: run xacro, and give the URDF")
    for element in list(root):
        if element.tag not in URDF_KEPT:
            root.remove(element)
    for link in root.iter("link"):
        for picture in link.findall("visual"):
            link.remove(picture)
    for mesh in root.iter("mesh"):
        mesh.set("filename", str(_mesh(path, mesh.get("filename", ""), packages)))
    settings = {"strippath": "false", "fusestatic": "false", "balanceinertia": "true", "discardvisual": "true"}
    ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler", settings)
    return root


def _mesh(path: Path, name: str, packages: Mapping[str, Path]) -> Path:
    """The file of a mesh of the URDF at `path`: relative to it, or in a ROS package."""
    if name.startswith(PACKAGE):
        package, _, inside = name.removeprefix(PACKAGE).partition("/")
        if package in packages:
            place = packages[package] / inside
        else:
            above = [each / inside for each in path.resolve().parents if each.name == package]
            beside = [each / package / inside for each in path.resolve().parents]
            place = next((each for each in (*above, *beside) if each.exists()), Path())
            if not place.name:
                raise ValueError(
                    f"mesh {name!r} is in the package {package!r}, which is not above the URDF; say where it is by "
                    f'packages = {{ {package} = "FOLDER" }}'
                )
    elif "://" in name and not name.startswith("file://"):
        raise ValueError(f"mesh {name!r} must be a path, {PACKAGE}… or file://…")
    else:
        place = path.resolve().parent / name.removeprefix("file://")
    if place.suffix.lower() not in MESHES:
        raise ValueError(f"mesh {name!r} must be one of {', '.join(MESHES)}")
    if not place.exists():
        raise ValueError(f"mesh {name!r} is not at {place}")
    return _regular(place)
