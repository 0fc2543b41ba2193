"""What an object may be, as a user says it: solids by label, or names of shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from haptic_env import shapes, validate
from haptic_env.hand import Hand
from haptic_env.shapes import Solid
from haptic_env.shapes.names import NONE


def checked(given: object, hand: Hand, none: float = 0.0) -> Mapping[str, Sequence[Solid]]:
    """Check what an object may be.

    Args:
        given: solids by label, or names of shapes; None: the four shapes.
        hand: that explores.
        none: prior probability of none of them, which is then a label of its own.

    Returns:
        Solids by label; those of names of their default size, where the hand explores.

    Raises:
        ValueError: unless labels are texts with one solid each at least, none of them the label of none, and names
            those of shapes, each there once.
    """
    if given is None:
        return {name: [shapes.make(name, position=hand.grasp_centre)] for name in shapes.SHAPES}
    wrong: object = given
    if isinstance(given, Mapping) and given:
        if none and NONE in given:
            raise ValueError(f"a candidate must not be called {NONE!r} where none > 0, got none={none!r}")
        wrong = next((pair for pair in given.items() if not isinstance(pair[0], str) or not _solids(pair[1])), None)
        if wrong is None:
            return given
    elif isinstance(given, list | tuple) and given and all(isinstance(each, str) for each in given):
        solids = {shapes.check("candidate", name): [shapes.usual(name, hand)] for name in given}
        if len(solids) == len(given):
            return solids
    raise ValueError(
        f"candidates must give each label at least one solid, got {validate.shown(wrong)}; or be a list of names of "
        "shapes, each there once"
    )


def _solids(given: object) -> bool:
    return isinstance(given, Sequence) and len(given) > 0 and all(isinstance(each, Solid) for each in given)
