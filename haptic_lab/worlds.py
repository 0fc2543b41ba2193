"""What is explored: the environment by its name, the object of an episode, and the candidates for its name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

import haptic_env
from haptic_env import registration, shapes, validate
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.shapes import Solid
from haptic_env.shapes.names import NONE, parsed
from haptic_lab.terminal import as_path


def as_shape(text: str) -> str:
    """Take the value of a flag that names a shape.

    Args:
        text: as it was typed.

    Returns:
        The path, or the name, always written the same way: it names columns, files and what a sweep goes on with.

    Raises:
        argparse.ArgumentTypeError: as `as_path`.
    """
    path = as_path(text)
    return str(parsed(path) or path)


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
    reach = max(max(each.size) for several in candidates.values() for each in (*several, solid))
    points = Grid.around(solid.position, np.full(3, 1.1 * reach), reach / 30).centres()
    inside = solid.signed_distance(points) < 0

    def common(other: Solid) -> float:
        theirs = other.signed_distance(points) < 0
        return float((inside & theirs).sum() / (inside | theirs).sum())

    return max(candidates, key=lambda label: max(common(each) for each in candidates[label]))


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
