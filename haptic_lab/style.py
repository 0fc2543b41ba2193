"""How every picture looks: one colour for one thing, safe for the colour-blind (Okabe & Ito 2008)."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex

from haptic_env import own
from haptic_env.shapes import FAMILIES, SHAPES, sets
from haptic_env.shapes.mesh import is_path, parted
from haptic_env.shapes.names import NONE

P = ParamSpec("P")
R = TypeVar("R")
RC: Any = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "legend.frameon": False,
    "figure.dpi": 110,
    "savefig.dpi": 160,
}

SPARE = ("#56B4E9", "#882255", "#44AA99", "#999999", "#AA4499", "#F0E442")  # for shapes to come, the most legible first
LONGEST = 40  # letters of a title in a picture
KNOWN = {"cube": "#0072B2", "sphere": "#D55E00", "pyramid": "#009E73", "cylinder": "#CC79A7"}

OBSERVER_COLOURS = {
    "floor": "#999999",
    "paper": "#882255",
    "kalman": "#E69F00",
    "smoother": "#56B4E9",
    "white": "#D55E00",
    "haptic_slam": "#000000",
    "second_look": "#0072B2",
    "ceiling": "#117733",
}
OBSERVER_NAMES = {
    "floor": "raw angles (floor)",
    "paper": "as the paper has it",
    "kalman": "Kalman",
    "smoother": "smoother",
    "white": "white noise believed",
    "haptic_slam": "haptic SLAM",
    "second_look": "second look",
    "ceiling": "true pose (ceiling)",
}
BETTER, WORSE = "#0072B2", "#D55E00"
OUTLINE = "#000000"
FREE = "#DCEBF5"
HAND = "#CDBDB6"
TRUTH = "#C9D3DC"  # of a solid; its outline is OUTLINE
UNFEELING = "#B4B0AD"  # skin without patches
TOUCHING = "#00A8E8"  # skin that touches
POSSIBLE = "#7A5CA8"  # a hand as it may be as well
MAP = ("#FBE3A6", "#F5A623", "#D9480F", "#6A0D1E")  # of voxels from hardly probable to certain
# From nothing at 0.5, which is not knowing, to dark at 1; on a scale from 0.5 to 1.
OCCUPANCY = LinearSegmentedColormap.from_list(
    "occupancy", [(0.0, "#FDD48A00"), (0.2, "#FDC765"), (0.55, "#E8590C"), (1.0, "#6A0D1E")]
)


def colours_of(labels: Iterable[str]) -> dict[str, str]:
    """Choose colours; that of a shape is always the same.

    Args:
        labels: shapes or mesh files.

    Returns:
        A colour for each label, "#RRGGBB".
    """
    spare = itertools.cycle(SPARE)
    fixed = {name: KNOWN.get(name) or next(spare) for name in SHAPES}
    return {label: fixed.get(label) or next(spare) for label in labels}


SHAPE_COLOURS = colours_of(SHAPES)


def titles_of(labels: Iterable[str]) -> dict[str, str]:
    """Choose what to call objects.

    Args:
        labels: shapes or mesh files.

    Returns:
        A title for each label: of a file's path as much as tells it from the others.
    """
    ways = {each: _ways(each) for each in labels}
    titles = {}
    for label, mine in ways.items():
        others = {way for other, theirs in ways.items() if other != label for way in theirs}
        titles[label] = next((way for way in mine if way not in others), label)
    return titles


def _ways(label: str) -> tuple[str, str, str]:
    """What an object may be called, the shortest first."""
    if sets.is_member(label):
        return sets.title(label), label, label
    path = Path(parted(label)[0])
    return (path.stem, path.name, label) if is_path(label) else (label,) * 3


def as_drawn(title: str) -> str:
    """Make a title that a picture can show.

    Args:
        title: any text.

    Returns:
        The same, short enough, in which dollars are no mathematics, and which no legend leaves out.
    """
    short = title if len(title) <= LONGEST else f"{title[: LONGEST // 2]}…{title[-LONGEST // 2 :]}"
    plain = short.replace("$", r"\$")
    return f" {plain}" if plain.startswith("_") else plain


def with_article(title: str, label: str | None = None) -> str:
    """Put "a" or "an" before a title.

    Args:
        title: of an object.
        label: that the title is of; None: the title.

    Returns:
        The two, "an ellipsoid(1, 1, 1.3)"; of "none", that it is none of these; the title alone of an object that was
        learnt, whose label is a name of its own.
    """
    if title == NONE:
        return "none of these"
    if label is not None and not _is_shape(label):
        return title
    return f"{'an' if title[:1] in 'aeio' or title.startswith('L(') else 'a'} {title}"


def _is_shape(label: str) -> bool:
    """Whether a label is of a shape or a file, there or not, rather than the name of one object."""
    family = label.partition("(")[0].rstrip()
    return family in {*SHAPES, *FAMILIES} or own.is_named(family) or is_path(label) or sets.is_member(label)


def noise_colours(noises: Sequence[float]) -> dict[float, str]:
    """Choose colours for noises, the darker the more.

    Args:
        noises: degrees.

    Returns:
        A colour for each noise, "#RRGGBB".
    """
    shades = matplotlib.colormaps["viridis"](np.linspace(0.8, 0.1, len(noises)))
    return {noise: to_hex(shade) for noise, shade in zip(sorted(noises), shades, strict=True)}


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Make pictures look as all of ours do, whatever else is drawn in this process.

    Args:
        function: that draws.

    Returns:
        The same, in our style.
    """

    @wraps(function)
    def drawing(*args: P.args, **keywords: P.kwargs) -> R:
        with matplotlib.rc_context(RC):
            return function(*args, **keywords)

    return drawing
