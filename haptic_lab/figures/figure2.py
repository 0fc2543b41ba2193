"""Figure 2 of the paper: where the hand may be, what it has felt, and where the object is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from haptic_env.hand import Hand
from haptic_lab.figures import isometric
from haptic_lab.figures.explorations import ShownExploration
from haptic_lab.figures.isometric_view import NEAR, IsometricView
from haptic_lab.figures.paper_figure import WIDTH, Find, PaperFigure, Wanted
from haptic_lab.panels import AXES, EMPTY, MM, TICKS
from haptic_lab.style import FREE, HAND, OCCUPANCY, OUTLINE, TRUTH

SHAPE, SIGMA = "sphere", 5.0
POSES = 150
NOTHING = "nothing felt to be solid yet"


def wanted(shapes: Sequence[str]) -> Wanted:
    """Choose the exploration of a sphere, as in the paper, where there is one.

    Args:
        shapes: that there are.

    Returns:
        One shape and sigma.
    """
    return [(SHAPE if SHAPE in shapes else shapes[0], SIGMA)]


def draw(wanted: Wanted, find: Find, hand: Hand) -> PaperFigure:
    """Draw the hand as felt and as inferred, the map over the true shape, and a section through it.

    Args:
        wanted: what `wanted` returns.
        find: reads an exploration.
        hand: that explored.

    Returns:
        The figure, and the voxels of the map as its data.
    """
    showing = find(*wanted[0])
    frame = _most_touched(showing)
    grid, solid = showing.grid, showing.solid
    view = IsometricView.around(grid)
    step = showing.step[frame] - 1
    occupancy = showing.occupancy[frame].astype(float)
    rng = np.random.default_rng(0)
    noise = np.deg2rad(float(showing.sigma_deg))
    felt = showing.felt_angles[step] + noise * rng.standard_normal((POSES, hand.joints))

    figure = Figure(figsize=(WIDTH, 6.4), layout="constrained")
    panels = figure.subplots(2, 2)
    for axes, poses, title in (
        (panels[0, 0], felt, f"(a) the hand as felt, σ = {showing.sigma_deg:g}° in each joint"),
        (panels[0, 1], showing.poses(frame, POSES), "(b) the hand as inferred"),
    ):
        isometric.prepare(axes, view, title)
        isometric.draw_solid(axes, solid, grid, view)
        isometric.draw_hand(axes, hand, poses, grid, view, solid)
        isometric.draw_hand_outline(axes, hand, showing.true_angles[step], grid, view)
    title = f"(c) the map after {showing.seconds[step]:.0f} s"
    isometric.draw_scene(panels[1, 0], occupancy, grid, solid, NEAR, title)
    _section(panels[1, 1], occupancy, showing)
    figure.legend(
        handles=[
            Patch(facecolor=HAND, label="where a finger may be"),
            Line2D([], [], color=OUTLINE, linestyle="--", linewidth=0.8, label="where it is"),
            Patch(facecolor=TRUTH, edgecolor=OUTLINE, linewidth=0.7, label="the true object"),
            Patch(facecolor=OCCUPANCY(0.6), label="voxel felt to be solid"),
            Patch(facecolor=FREE, label="swept by a finger: empty"),
            Patch(facecolor="white", edgecolor="#999999", label="never entered"),
        ],
        loc="outside lower center",
        ncols=3,
    )
    return PaperFigure(figure, map_table(occupancy, occupancy != 0.5, showing))


def map_table(occupancy: np.ndarray, chosen: np.ndarray, showing: ShownExploration) -> pd.DataFrame:
    """List voxels of a map.

    Args:
        occupancy: (X, Y, Z) probabilities.
        chosen: (X, Y, Z) which are listed.
        showing: has the grid.

    Returns:
        A line for each voxel: its middle in mm from that of the grid, and how probably it is solid.
    """
    grid = showing.grid
    places = (grid.centres() - grid.centre)[chosen] * MM
    columns = {f"{axis}_mm": places[:, number].round(3) for number, axis in enumerate(AXES)}
    return pd.DataFrame({**columns, "probability": occupancy[chosen].round(4)})


def _most_touched(showing: ShownExploration) -> int:
    """The frame, of the second half, at which most patches touch."""
    touched = showing.contacts[showing.step - 1].sum(axis=1)
    half = len(touched) // 2
    return half + int(np.argmax(touched[half:]))


def _section(axes: Axes, occupancy: np.ndarray, showing: ShownExploration) -> None:
    """The slice across y in which most was touched, or through the object's middle where nothing was, three voxels
    thick: a finger is no thinner."""
    grid, solid = showing.grid, showing.solid
    felt = occupancy > 0.5
    solid_voxels = np.convolve(felt.sum(axis=(0, 2)), np.ones(3), mode="same")
    middle = round((solid.position[1] - grid.origin[1]) / grid.resolution - 0.5)
    layer = int(np.clip(np.argmax(solid_voxels) if felt.any() else middle, 1, grid.shape[1] - 2))
    near = occupancy[:, layer - 1 : layer + 2]
    highest = near.max(axis=1)
    empty = (near < EMPTY).any(axis=1) & (highest <= 0.5)
    half = 0.5 * grid.extent * MM
    edges = -half[0], half[0], -half[2], half[2]
    place: dict[str, Any] = {"origin": "lower", "extent": edges, "interpolation": "nearest"}
    axes.imshow(np.ma.masked_equal(empty.T, False), cmap=ListedColormap([FREE]), **place)
    axes.imshow(np.ma.masked_less_equal(highest.T, 0.5), cmap=OCCUPANCY, vmin=0.5, vmax=1.0, **place)
    centres = grid.centres()[:, layer]
    x, z = ((centres[..., axis] - grid.centre[axis]) * MM for axis in (0, 2))
    axes.contour(x, z, solid.signed_distance(centres), levels=[0.0], colors=[OUTLINE], linewidths=1.2)
    y = (grid.centres()[0, layer, 0, 1] - grid.centre[1]) * MM
    what = "where the object is" if felt.any() else NOTHING
    axes.set(
        title=f"(d) {what}: section at y = {y:.0f} mm",
        xlabel="x (mm)",
        ylabel="z (mm)",
        xticks=TICKS,
        yticks=TICKS,
        aspect="equal",
    )
