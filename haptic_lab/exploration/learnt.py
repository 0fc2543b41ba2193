"""Objects that an exploration learns, and those learnt before that it may recognise."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from haptic_env import validate
from haptic_env.hand import Hand
from haptic_env.shapes import triangles
from haptic_env.shapes.names import NONE
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.terminal import tell
from haptic_lab.worlds import Candidates, truth_among
from observer.library import DamagedEntry, Library
from observer.surface.felt_shape import KNOWN

if TYPE_CHECKING:
    from haptic_lab.exploration.settings import ExplorationSettings

SHAPE = "shape"  # of an object that was learnt in the simulation: what it is there
OFF = 0.02  # m, by which the middle of what was felt may be off that of the object
ANY_WAY = 180.0  # degrees


def resolve(given: dict[str, Any]) -> None:
    """Say that an object lies any way where one learnt before is sought, unless it is said how.

    Args:
        given: the flags; `rotation_jitter` may change.
    """
    turned = given["rotation_jitter"], given["yaw_jitter"]
    if given["library"] is not None and given.get("name") is None and turned == (None, None):
        given["rotation_jitter"] = ANY_WAY


def check(settings: ExplorationSettings) -> None:
    """Check that an object can be added to a library, or that there is one.

    Args:
        settings: of an exploration.

    Raises:
        ValueError: where not.
    """
    if settings.library is None:
        return
    try:
        library = Library(settings.library)
        if settings.name is not None:
            library.check(settings.name, replace=settings.replace)
        elif not library.names:
            raise ValueError(f"{validate.shown(settings.library)} is no library with an object in it; learn one first")
        triangles.check()
    except (ValueError, ImportError) as error:
        raise ValueError(f"--library: {error}") from error


def candidates(settings: ExplorationSettings, hand: Hand) -> Candidates:
    """List the objects of the library that may be recognised; a damaged one is left out, which is told.

    Args:
        settings: of an exploration.
        hand: that explores.

    Returns:
        Solids by name; none where the exploration is of no library, or adds to it.

    Raises:
        ValueError: where none of the library can be read, and for one that is called like another candidate.
    """
    if settings.library is None or settings.name is not None:
        return {}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DamagedEntry)
        found = Library(settings.library).candidates(hand)
    for each in caught:
        tell("warning", str(each.message))
    if not found:
        raise ValueError(f"--library {validate.shown(settings.library)}: none of its objects can be read")
    return found


def both(known: Candidates, learnt: Candidates) -> Candidates:
    """Put candidates together.

    Args:
        known: shapes by name.
        learnt: objects of a library.

    Returns:
        All.

    Raises:
        ValueError: where two are called the same.
    """
    twice = [name for name in learnt if name in known]
    if twice:
        raise ValueError(
            f"{validate.listed(twice)} of the library and of the other candidates: say by --candidates which others"
        )
    return {**known, **learnt}


def sources(settings: ExplorationSettings) -> dict[str, str]:
    """Tell what objects of the library are in the simulation in which they were learnt.

    Args:
        settings: of an exploration.

    Returns:
        Shapes by the names of the objects; none where the exploration recognises none.
    """
    if settings.library is None or settings.name is not None:
        return {}
    library = Library(settings.library)
    about = {name: library[name].about for name in library if name not in library.damaged}
    return {name: each[SHAPE] for name, each in about.items() if isinstance(each.get(SHAPE), str)}


def truth(settings: ExplorationSettings, exploration: Exploration, among: Candidates) -> str:
    """Find what the object would be called rightly.

    Args:
        settings: of the exploration.
        exploration: what happened.
        among: the candidates.

    Returns:
        Its label.
    """
    solid = exploration.solid
    if solid.name not in among:
        for name, shape in sources(settings).items():
            if shape == solid.name and name in among:
                return name
    return truth_among(solid, among, none=settings.none > 0.0)


def keep(settings: ExplorationSettings, exploration: Exploration, trace: BeliefTrace) -> str:
    """Add what was felt to the library.

    Args:
        settings: of the exploration, with a name.
        exploration: what happened.
        trace: what the observer believed.

    Returns:
        What to tell of it.
    """
    assert settings.library is not None
    assert settings.name is not None
    surface = trace.belief.surface()
    if surface.empty:
        return f"Nothing was touched: {settings.name} is not learnt."
    about: Mapping[str, Any] = {
        "hand": settings.env,
        "seconds": float(exploration.seconds[-1]),
        "sigma_deg": settings.sigma,
        "seed": settings.seed,
        SHAPE: exploration.solid.name,
    }
    Library(settings.library).add(settings.name, surface, about, replace=settings.replace)
    share = float((surface.std < KNOWN).mean())
    return f"Learnt {settings.name}: {share:.0%} of its surface is known to {1e3 * KNOWN:g} mm, the rest is a guess."


def verdict(settings: ExplorationSettings, named: str, sure: float) -> str | None:
    """Say what an exploration has recognised.

    Args:
        settings: of the exploration.
        named: what the object was called.
        sure: its probability.

    Returns:
        What to tell; None where it was called neither after an object of a library nor "none".
    """
    if settings.library is None:
        return None
    if named == NONE:
        return f"Never felt this, {sure:.2f}."
    return f"This is what you called {named}, {sure:.2f}." if named in Library(settings.library) else None
