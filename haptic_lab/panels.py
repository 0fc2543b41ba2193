"""The panels of the pictures: a map over the true shape, a pose error and a posterior through time.

Shapes: T steps, C labels, (X, Y, Z) voxels. Pictures are in millimetres about the middle of the map.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import ArrayLike

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from haptic_env.shapes import Solid
from haptic_lab.style import FREE, HAND, OCCUPANCY, OUTLINE, as_drawn, colours_of, titles_of
from observer.kinematics import link_frames, placed, tree_of
from observer.maps.contact_model import ContactModel

SIDES = {"from the front": (0, 2), "from the side": (1, 2), "from above": (0, 1)}  # title: axes across and up
AXES = "xyz"
MM = 1000.0
TICKS = (-40, 0, 40)
EMPTY = 0.5 * ContactModel.prior  # half of what a voxel near the hand begins with: fingers have been inside


def draw_map(
    axes: Axes,
    occupancy: Array,
    grid: Grid,
    solid: Solid | None,
    side: str,
    hand: Hand | None = None,
    angles: Any = None,
    root: Pose | None = None,
) -> Any:
    """Draw the map from one side: the most probable voxel along each line of sight, space that fingers have been in,
    the outline of the true object, and the hand.

    Args:
        axes: to draw into.
        occupancy: (X, Y, Z) probabilities.
        grid: of the map.
        solid: the true object; None: nobody knows.
        side: one of `SIDES`.
        hand: that is drawn; None: none is.
        angles: (J,) rad, its pose.
        root: where the hand as a whole is, if it moves.

    Returns:
        The image that a colour bar needs.
    """
    across, up = SIDES[side]
    (depth,) = {0, 1, 2} - {across, up}
    middle = grid.centre * MM
    half = 0.5 * grid.extent * MM
    extent = (-half[across], half[across], -half[up], half[up])

    free = (occupancy < EMPTY).any(axis=depth)
    highest = occupancy.max(axis=depth)
    shown: dict[str, Any] = {"origin": "lower", "extent": extent, "interpolation": "nearest"}
    axes.imshow(np.ma.masked_equal(free.T, False), cmap=ListedColormap([FREE]), zorder=0, **shown)
    image = axes.imshow(np.ma.masked_less_equal(highest.T, 0.5), cmap=OCCUPANCY, vmin=0.5, vmax=1.0, zorder=2, **shown)
    if hand is not None:
        _draw_hand(axes, hand, angles, root, across, up, middle, extent)
    if solid is not None:
        _draw_outline(axes, solid, grid, across, up, depth)
    axes.set(
        title=side,
        xlabel=f"{AXES[across]} (mm)",
        ylabel=f"{AXES[up]} (mm)",
        xlim=extent[:2],
        ylim=extent[2:],
        aspect="equal",
        xticks=TICKS,
        yticks=TICKS,
    )
    return image


def draw_sides(
    panel: Any,
    occupancy: Array,
    grid: Grid,
    solid: Solid | None,
    hand: Hand,
    angles: Any,
    root: Pose | None = None,
    outline: str = "the true shape",
) -> None:
    """Draw the map from all `SIDES`, and what its colours mean.

    Args:
        panel: the figure, or part of it, to draw into.
        occupancy: (X, Y, Z) probabilities.
        grid: of the map.
        solid: the true object; None: nobody knows.
        hand: that is drawn.
        angles: (J,) rad, its pose.
        root: where the hand as a whole is, if it moves.
        outline: what the object is called.
    """
    sides = panel.subplots(1, len(SIDES))
    panel.figure.draw_without_rendering()  # the hand's lines need the size of the panels
    for axes, side in zip(sides, SIDES, strict=True):
        image = draw_map(axes, occupancy, grid, solid, side, hand, angles, root)
    panel.colorbar(image, ax=sides, label="probability that it is solid", shrink=0.75, aspect=25)
    true = [] if solid is None else [Line2D([], [], color=OUTLINE, linewidth=1.8, label=outline)]
    colours = [
        Patch(color=OCCUPANCY(0.6), label="probably solid"),
        Patch(color=FREE, label="probably empty"),
        Patch(color=HAND, label="the fingers at the end, as believed"),
    ]
    panel.legend(handles=[*true, *colours], loc="outside lower center", ncols=4, fontsize=9)


def draw_pose_error(
    axes: Axes,
    seconds: Array,
    errors: Mapping[str, tuple[Array, str]],
    touching: ArrayLike,
    sigma_deg: float,
) -> None:
    """Draw pose errors through time.

    Args:
        axes: to draw into.
        seconds: (T,).
        errors: label → error (T,) degrees and its colour.
        touching: (T,) steps that are shaded.
        sigma_deg: noise of the felt angles, degrees.
    """
    top = max(float(error.max()) for error, _ in errors.values()) * 1.05 + 0.1
    axes.fill_between(seconds, 0, top, where=touching, color="#EEEEEE", step="mid", linewidth=0, label="touching")
    for label, (error, colour) in errors.items():
        axes.plot(seconds, error, color=colour, linewidth=1.2, label=label)
    axes.axhline(sigma_deg, color="#777777", linewidth=0.8, linestyle=":")
    axes.text(seconds[-1], sigma_deg, " σ", color="#555555", va="center")
    label_time(axes, seconds, "Where the hand is", "pose error (degrees)", top, 3)


def label_time(axes: Axes, seconds: Array, title: str, what: str, top: float, columns: int) -> None:
    """Label a panel of how far, or how surely, the hand is known through time.

    Args:
        axes: of the panel, in which all is drawn.
        seconds: (T,).
        title: of the panel.
        what: is drawn, with its unit.
        top: the largest that is shown.
        columns: of the legend.
    """
    axes.set(title=title, xlabel="time (s)", ylabel=what, ylim=(0, top), xlim=(0, seconds[-1]))
    axes.legend(loc="upper left", ncols=columns, fontsize=8, frameon=True, framealpha=0.9, edgecolor="none")


def draw_posterior(
    axes: Axes, seconds: Array, posterior: Array, labels: Sequence[str], truth: str, really: str = "the truth"
) -> None:
    """Draw the posterior of the name through time.

    Args:
        axes: to draw into.
        seconds: (T,).
        posterior: (T, C).
        labels: (C,).
        truth: the label whose curve is the thick one.
        really: what is said of it.
    """
    colours, titles = colours_of(labels), titles_of(labels)
    for column, label in enumerate(labels):
        thick, title = label == truth, as_drawn(titles[label])
        axes.plot(
            seconds,
            posterior[:, column],
            color=colours[label],
            linewidth=2.5 if thick else 1.2,
            label=f"{title} ({really})" if thick else title,
        )
    axes.axhline(0.95, color="#777777", linewidth=0.8, linestyle=":")
    axes.set(title="What the object is", xlabel="time (s)", ylabel="posterior", ylim=(0, 1.02), xlim=(0, seconds[-1]))
    axes.legend(loc="center right", fontsize=8, frameon=True, framealpha=0.9, edgecolor="none")


def _draw_outline(axes: Axes, solid: Solid, grid: Grid, across: int, up: int, depth: int) -> None:
    fine, distance = _distances(solid)
    distance = distance.min(axis=depth)
    places = fine.centres() - grid.centre
    lines = [np.moveaxis(places[..., axis], axis, 0)[:, 0, 0] * MM for axis in (across, up)]
    axes.contour(*lines, distance.T, levels=[0.0], colors=[OUTLINE], linewidths=1.8, zorder=4)


@lru_cache(maxsize=1)
def _distances(solid: Solid) -> tuple[Grid, Array]:
    """A grid about `solid`, and its signed distance (X, Y, Z) m there: the same for all sides, and slow for a mesh."""
    reach = 1.1 * float(np.linalg.norm(solid.size))
    fine = Grid.around(solid.position, np.full(3, reach), max(0.001, reach / 64))
    return fine, solid.signed_distance(fine.centres())


def _draw_hand(
    axes: Axes,
    hand: Hand,
    angles: Any,
    root: Pose | None,
    across: int,
    up: int,
    middle: Array,
    extent: tuple[float, ...],
) -> None:
    """Each link as a line as wide as the link."""
    bones = hand.bones(*link_frames(placed(tree_of(hand), root), angles))
    figure = axes.figure
    points_per_mm = axes.get_window_extent().width * 72 / figure.dpi / (extent[1] - extent[0])
    for link, bone in zip(hand.links, bones, strict=True):
        ends = bone * MM - middle
        width = 2 * link.radius * MM * points_per_mm
        axes.plot(ends[:, across], ends[:, up], color=HAND, linewidth=width, solid_capstyle="round", zorder=1)
