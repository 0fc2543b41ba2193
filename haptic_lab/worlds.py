"""What is explored: the environment by its name, the object of an episode, and the candidates for its name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

import haptic_env
from haptic_env import shapes, validate
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.shapes import Solid


def solid_of(truth: Mapping[str, Any]) -> Solid:
    """The object that `info["truth"]` describes."""
    place = truth["object_position"], truth["object_quaternion"]
    return shapes.make(truth["shape"], truth["object_size"], *place)


def candidates_of(
    hand: Hand, names: Iterable[str], *, like: str | None = None, scale: float = 1.0
) -> dict[str, list[Solid]]:
    """What the object may be: `names`, each where `hand` explores it. With `like` one of them, or the file of a mesh
    whose unit is `scale` metres long: a mesh is a candidate itself, and all others are as large as it, on average."""
    if like is None or like in shapes.SHAPES:
        sizes = {name: shapes.default_size(name, scale) for name in names}
        return {name: [shapes.make(name, size, hand.place(size))] for name, size in sizes.items()}
    size = shapes.default_size(like, scale)
    place = hand.place(size)
    others = {name: [shapes.make(name, np.full(3, size.mean()), place)] for name in names}
    return {like: [shapes.make(like, size, place)], **others}


Candidates = Mapping[str, list[Solid]]


def truth_among(solid: Solid, candidates: Candidates) -> str:
    """The name of `solid` among the labels of `candidates`; where it is not one, that of the candidate that shares
    most with it (their common volume over that of both together)."""
    if solid.name in candidates:
        return solid.name
    reach = max(max(each.size) for several in candidates.values() for each in (*several, solid))
    points = Grid.around(solid.position, np.full(3, 1.1 * reach), reach / 30).centres()
    inside = solid.signed_distance(points) < 0

    def common(other: Solid) -> float:
        theirs = other.signed_distance(points) < 0
        return float((inside & theirs).sum() / (inside | theirs).sum())

    return max(candidates, key=lambda label: max(common(each) for each in candidates[label]))


HANDS_OR_IDS = f"{', '.join(haptic_env.ENVIRONMENTS.values())}, or the id of an environment"


def environment(name: str) -> str:
    """The id of the environment `name`, which may be said by its hand alone; raises `ValueError` for neither."""
    of_hand = {hand: env_id for env_id, hand in haptic_env.ENVIRONMENTS.items()}
    return of_hand.get(validate.choice("--hand or --env", name, (*of_hand, *haptic_env.ENVIRONMENTS)), name)
