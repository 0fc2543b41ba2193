"""Objects that an exploration learns, and those learnt before that it may recognise."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from rich.console import Console

from haptic_env import shapes, validate
from haptic_env.hand import Hand
from haptic_env.shapes import Solid, triangles
from haptic_env.shapes.names import NONE
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.terminal import as_path
from haptic_lab.terminal import refuse as refuse_at_once
from haptic_lab.terminal import tell as tell_at_once
from haptic_lab.worlds import Candidates, truth_among
from observer import ShapePosterior
from observer.library import DamagedEntry, Library
from observer.surface import Surface
from observer.surface.felt_shape import KNOWN

if TYPE_CHECKING:
    from haptic_lab.exploration.settings import ExplorationSettings

JITTER = ("size_jitter", "position_jitter", "yaw_jitter", "rotation_jitter")
SHAPE = "shape"  # of an object that was learnt in the simulation: what it is there
OFF = 0.02  # m, by which the middle of what was felt may be off that of the object
ANY_WAY = 180.0  # degrees


def add_flags(add: Callable[..., Any], learning: bool) -> None:
    """Let a command take a library, and an object that varies.

    Args:
        add: adds an argument to its parser.
        learning: whether it adds to the library.
    """
    if learning:
        add("name", metavar="NAME", help="what the object is called")
        add("--replace", action="store_true", help="in place of what is called so in the library")
    kept = "where it is kept (default objects)" if learning else "what it may be besides: objects learnt before"
    add("--library", type=as_path, metavar="DIR", default="objects" if learning else None, help=kept)
    add("--size-jitter", type=float, help="how the object's size varies, a fraction (default 0)")
    add("--position-jitter", type=float, help="how far it is off the grasp centre, in m (default 0)")
    add("--yaw-jitter", type=float, help="how far it is turned, in degrees (default 0)")
    any_way = "0" if learning else "0, with --library 180"
    add("--rotation-jitter", type=float, help=f"or about any axis; 180: any way (default {any_way})")


def refuse(given: Mapping[str, Any]) -> None:
    """Refuse what makes no sense of the recording of an exploration.

    Args:
        given: the flags.

    Raises:
        ValueError: for an object that varies, and for a library in which it would be sought.
    """
    if given["library"] is not None and given.get("name") is None:
        raise ValueError(
            "--library is for explorations and measured touch: the object of another recording is sought among the "
            "four shapes and --mesh"
        )
    refuse_varied(given)


def refuse_varied(given: Mapping[str, Any]) -> None:
    """Refuse an object that varies, of a recording.

    Args:
        given: the flags.

    Raises:
        ValueError: for one that is not 0.
    """
    for name in JITTER:
        if given[name]:
            flag = name.replace("_", "-")
            raise ValueError(f"--{flag} is for explorations: a recording's object lay as it was recorded")


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
        tell_at_once("warning", str(each.message))
    if not found:
        raise ValueError(f"--library {validate.shown(settings.library)}: none of its objects can be read")
    return found


def naming(
    settings: ExplorationSettings, hand: Hand, known: Candidates, **keywords: float
) -> tuple[ShapePosterior, Candidates]:
    """Make who names the object.

    Args:
        settings: of an exploration.
        hand: that explores.
        known: what the object may be, beside what was learnt, which takes the place of the shape that it is in the
            simulation where nobody has named candidates.
        **keywords: of the namer.

    Returns:
        The namer, and its candidates.

    Raises:
        ValueError: where none of the library can be read, and for an object that is called like another candidate.
    """
    told: dict[str, Any] = {**keywords, **settings.jitter}
    felt = candidates(settings, hand)
    if felt:
        told["position_jitter"] = max(settings.position_jitter, OFF)
        if settings.among is None:
            known = {
                name: each for name, each in known.items() if name in {*shapes.SHAPES} - {*sources(settings).values()}
            }
        twice = [name for name in felt if name in known]
        if twice:
            raise ValueError(
                f"{validate.listed(twice)} of the library and of the other candidates: say by --candidates which others"
            )
    everything = {**known, **felt}
    return ShapePosterior(hand, everything, none=settings.none, **told), everything


def sources(settings: ExplorationSettings) -> dict[str, str]:
    """Tell what objects of the library are in the simulation in which they were learnt.

    Args:
        settings: of an exploration.

    Returns:
        Shapes by the names of the objects; none where the exploration recognises none.
    """
    if settings.library is None or settings.name is not None:
        return {}
    whole, _ = Library(settings.library).read()
    return {name: each.about[SHAPE] for name, each in whole.items() if isinstance(each.about.get(SHAPE), str)}


def truth(settings: ExplorationSettings, solid: Solid, among: Candidates, none: bool) -> str:
    """Find what the object would be called rightly.

    Args:
        settings: of the exploration.
        solid: that is explored.
        among: the candidates.
        none: whether it may be none of them.

    Returns:
        Its label.
    """
    if solid.name not in among:
        for name, shape in sources(settings).items():
            if shape == solid.name and name in among:
                return name
    return truth_among(solid, among, none=none)


def tell(console: Console, settings: ExplorationSettings, exploration: Exploration, trace: BeliefTrace) -> None:
    """Add what was felt to the library, or say what was recognised; where nothing of a library is asked for, neither.

    Args:
        console: that it is told on.
        settings: of the exploration.
        exploration: what happened.
        trace: what the observer believed.
    """
    if settings.library is None:
        return
    library, named = Library(settings.library), trace.name
    sure = float(trace.posterior[-1][trace.labels.index(named)])
    if settings.name is not None:
        try:
            said = _added(library, settings, exploration, trace.belief.surface())
        except (ValueError, OSError) as error:  # taken meanwhile, of no size that one could hold, a full disk
            refuse_at_once(f"{settings.name} is not learnt: {error}")
        console.print(said, highlight=False)
    elif named == NONE:
        console.print(f"Never felt this, {sure:.2f}.", highlight=False)
    elif named in library:
        console.print(f"This is what you called {named}, {sure:.2f}.", highlight=False)


def _added(library: Library, settings: ExplorationSettings, exploration: Exploration, surface: Surface) -> str:
    """Add a surface to the library, and tell how much of it is known."""
    assert settings.name is not None
    if surface.empty:
        return f"Nothing was touched: {settings.name} is not learnt."
    solid = exploration.solid
    about: Mapping[str, Any] = {
        "hand": settings.env,
        "seconds": float(exploration.seconds[-1]),
        "sigma_deg": settings.sigma,
        "seed": settings.seed,
        **({} if solid is None else {SHAPE: solid.name}),
    }
    library.add(settings.name, surface, about, replace=settings.replace)
    share = float((surface.std < KNOWN).mean())
    return f"Learnt {settings.name}: {share:.0%} of its surface is known to {1e3 * KNOWN:g} mm, the rest is a guess."
