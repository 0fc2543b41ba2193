"""What is explored: the environment by its name, the object of an episode, and the candidates for its name."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import haptic_env
from haptic_env import registration, shapes, validate
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.shapes import Solid, sets
from haptic_env.shapes.names import NONE
from haptic_lab.terminal import as_path

SETS = f"{', '.join(sets.SETS)}, or a TOML file of objects (docs/objects.md)"


def as_shape(text: str) -> str:
    """Take the name of a shape from a file.

    Args:
        text: as it was written.

    Returns:
        The path, or the name, always written the same way: it names columns, files and what a sweep goes on with.

    Raises:
        argparse.ArgumentTypeError: as `as_path`.
    """
    return shapes.written(as_path(text))


def typed_shape(text: str) -> str:
    """Take the value of a flag that names a shape. Whoever types the name of a class of their own wants it imported.

    Args:
        text: as it was typed.

    Returns:
        As `as_shape`.

    Raises:
        argparse.ArgumentTypeError: as `as_path`, and where the module of a class cannot be imported.
    """
    name = as_shape(text)
    try:
        if not sets.is_member(name):  # what a set says stands in a file
            shapes.allow([name])
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return name


def expanded(names: Iterable[str], *, trust: bool = False) -> list[str]:
    """Put the objects of sets in the place of the sets.

    Args:
        names: of shapes, and of sets among them.
        trust: whether the modules of classes that a file names are imported.

    Returns:
        Names of shapes.

    Raises:
        ValueError: for a file that is no set of objects, and a module that cannot be imported.
    """
    several: list[str] = []
    for name in names:
        is_set = name in sets.SETS or Path(name).suffix.lower() == sets.SUFFIX
        several += sets.read(name) if is_set else [name]
    if trust:
        shapes.allow(several)
    return several


def shapes_of(told: Any) -> tuple[str, ...]:
    """Take what a file or a keyword tells of shapes.

    Args:
        told: the name of a shape or a set, or several.

    Returns:
        Names of shapes, written the one way.

    Raises:
        ValueError: for what are no names, and a file that is no set of objects.
    """
    several = (told,) if isinstance(told, str) else told
    return tuple(expanded(map(shapes.written, validate.names("shapes", several))))


def named_or_set(named: Sequence[str] | None, objects: str | None) -> Sequence[str] | None:
    """Tell what is explored.

    Args:
        named: what --shapes says; None: nothing.
        objects: what --objects says; None: nothing.

    Returns:
        Names of shapes, and of sets among them; None where neither says anything.

    Raises:
        ValueError: where both do, and for what is no set.
    """
    if objects is None:
        return named
    if named is not None:
        raise ValueError("--objects says what is explored, and so does --shapes: say one of them")
    return sets.read(objects)


def in_set(name: str, objects: str) -> str:
    """Find an object by what it is called in a set.

    Args:
        name: of a shape, or as the set calls it.
        objects: name or path of the set.

    Returns:
        The name by which it is found.

    Raises:
        ValueError: for what is no set.
    """
    full = f"{objects}:{name}"
    return full if full in sets.read(objects) else name


def solid_of(truth: Mapping[str, Any]) -> Solid:
    """Make the object of an episode.

    Args:
        truth: as `info["truth"]` describes it.

    Returns:
        The object, in the world.
    """
    place = truth["object_position"], truth["object_quaternion"]
    return shapes.make(truth["shape"], truth["object_size"], *place)


def candidates_of(
    hand: Hand, names: Iterable[str], *, like: str | None = None, scale: float = 1.0
) -> dict[str, list[Solid]]:
    """List what the object may be.

    Args:
        hand: that explores, each candidate where it does.
        names: of the candidates.
        like: one of them, or the file of a mesh, or a shape with a size or proportions: it is a candidate itself in
            place of its plain namesake, and all others are as large as it, on average.
        scale: metres that the unit of the mesh is long.

    Returns:
        Solids by label.
    """
    if like is None or like in shapes.SHAPES:
        return {name: [shapes.usual(name, hand, scale)] for name in names}
    itself = shapes.usual(like, hand, scale)
    others = {
        name: [shapes.make(name, np.full(3, np.mean(itself.size)), itself.position)]
        for name in names
        if type(shapes.find(name)) is not type(itself.shape)
    }
    return {like: [itself], **others}


Candidates = Mapping[str, list[Solid]]


def truth_among(solid: Solid, candidates: Candidates, none: bool = False) -> str:
    """Find the object among candidates.

    Args:
        solid: the object.
        candidates: by label.
        none: whether it may be none of them.

    Returns:
        Its label; where it is none of them "none", or that of the candidate that shares most with it (their common
        volume over that of both together).
    """
    if solid.name in candidates:
        return solid.name
    if none:
        return NONE
    return max(candidates, key=lambda label: max(common_volume(solid, each) for each in candidates[label]))


def common_volume(solid: Solid, other: Solid) -> float:
    """Tell how much two solids share.

    Args:
        solid: one.
        other: another.

    Returns:
        Their common volume over that of both together.
    """
    reach = max(*solid.size, *other.size)
    points = Grid.around(solid.position, np.full(3, 1.1 * reach), reach / 30).centres()
    inside, theirs = (each.signed_distance(points) < 0 for each in (solid, other))
    return float((inside & theirs).sum() / (inside | theirs).sum())


WRISTS = "fixed, or free: the hand moves as a whole (default: fixed, where a hand has the choice)"
HANDS_OR_IDS = f"{', '.join(haptic_env.ENVIRONMENTS.values())}, the id of an environment, or a hand.toml of your own"


def environment(name: str) -> str:
    """Find an environment.

    Args:
        name: its id, or that of its hand alone; or the path of a TOML file that describes a hand.

    Returns:
        Its id, or that path, which `haptic_env.registration` takes for one.

    Raises:
        ValueError: for neither, and for a file that describes none.
    """
    if registration.is_file(name):
        return registration.check("--hand", as_path(name))
    of_hand = {hand: env_id for env_id, hand in haptic_env.ENVIRONMENTS.items()}
    return of_hand.get(validate.choice("--hand or --env", name, (*of_hand, *haptic_env.ENVIRONMENTS)), name)
