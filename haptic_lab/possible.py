"""What an object may be, as the settings say; and of a recording, whose object is told, what else."""

from __future__ import annotations

from typing import Any

import numpy as np

from haptic_env import shapes
from haptic_env.hand import Hand
from haptic_env.shapes import Solid
from haptic_lab.worlds import Candidates, candidates_of, common_volume

ALIKE = 0.85  # common volume of two solids over that of both together, above which no touch tells them apart
DOUBT = 0.1  # prior probability that an object is none of those that an observer is told


def chosen(settings: Any, hand: Hand) -> Candidates:
    """List what the object may be, as the settings say.

    Args:
        settings: `ExplorationSettings`.
        hand: that explores.

    Returns:
        Solids by label: those that are named, each at its own size; where none are named, the four shapes and `shape`.

    Raises:
        ValueError: for a name that is none.
    """
    if settings.among is None:
        return candidates_of(hand, shapes.SHAPES, like=settings.shape, scale=settings.scale)
    names = [shapes.check("--candidates", name) for name in settings.among]
    return candidates_of(hand, names, scale=settings.scale)


def beside(settings: Any, solid: Solid) -> Candidates:
    """List what the object of a recording may be, at its place.

    Args:
        settings: `ExplorationSettings`.
        solid: the object.

    Returns:
        Solids by label: those that are named, of the four shapes each as large as the object on average, meshes as
        large as they are; where none are named the object itself and the four shapes, but for those that are all but
        the object.

    Raises:
        ValueError: for a name that is none.
    """
    size = np.full(3, np.mean(solid.size))
    four = {name: shapes.make(name, size, solid.position) for name in shapes.SHAPES}
    if settings.among is None:
        if solid.name in four:
            return {name: [each] for name, each in four.items()}
        others = {name: [each] for name, each in four.items() if common_volume(solid, each) < ALIKE}
        return {solid.name: [solid], **others}
    named = {}
    for name in settings.among:
        shapes.check("--candidates", name)
        if name == solid.name:
            named[name] = [solid]
        elif name in four:
            named[name] = [four[name]]
        else:
            named[name] = [shapes.make(name, shapes.default_size(name, settings.scale), solid.position)]
    return named


def doubt_of(settings: Any, solid: Solid, candidates: Candidates) -> float:
    """Tell how probable it is beforehand that the object is none of the candidates.

    Args:
        settings: `ExplorationSettings`.
        solid: the object.
        candidates: by label.

    Returns:
        What the settings say; where they say 0, but the object is not among the candidates, `DOUBT`.
    """
    return settings.none or (0.0 if solid.name in candidates else DOUBT)
