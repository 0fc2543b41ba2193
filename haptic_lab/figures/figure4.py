"""Figure 4 of the paper: the map grows over the true shape."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_lab.figures import isometric
from haptic_lab.figures.explorations import ShownExploration
from haptic_lab.figures.figure2 import NOTHING, map_table
from haptic_lab.figures.isometric_view import NEAR
from haptic_lab.figures.paper_figure import WIDTH, Find, PaperFigure, Wanted
from haptic_lab.style import OCCUPANCY

SHAPE, SIGMA = "pyramid", 1.0
MOMENTS = (0.1, 1 / 6, 1 / 3, 1 / 2, 2 / 3, 1.0)  # of the exploration


def wanted(shapes: Sequence[str]) -> Wanted:
    """Choose one exploration with little noise.

    Args:
        shapes: that there are.

    Returns:
        One shape and sigma.
    """
    return [(SHAPE if SHAPE in shapes else shapes[-1], SIGMA)]


def draw(wanted: Wanted, find: Find, hand: Hand) -> PaperFigure:
    """Draw the voxels that are more probably solid than not, at `MOMENTS`.

    Args:
        wanted: what `wanted` returns.
        find: reads an exploration.
        hand: that explored.

    Returns:
        A panel for each moment.
    """
    showing = find(*wanted[0])
    figure = Figure(figsize=(WIDTH, 4.3), layout="constrained")
    panels = figure.subplots(2, 3)
    tables = []
    for axes, seconds in zip(panels.ravel(), _moments(showing), strict=True):
        frame = showing.frame_at(seconds)
        occupancy = showing.occupancy[frame].astype(float)
        scale = 20.0 if axes is panels[0, 0] else 0.0
        isometric.draw_scene(axes, occupancy, showing.grid, showing.solid, NEAR, f"{seconds:.3g} s", scale)
        if not (occupancy > 0.5).any():
            axes.text(0.5, 0.92, NOTHING, transform=axes.transAxes, ha="center", color="#777777", fontsize=7)
        shown = map_table(occupancy, occupancy > 0.5, showing)
        tables.append(shown.assign(seconds=showing.seconds[showing.step[frame] - 1]))
    probability_bar(figure, panels)
    figure.suptitle(f"The contact map grows (σ = {showing.sigma_deg:g}°)", fontsize=9, fontweight="bold")
    return PaperFigure(figure, pd.concat(tables))


def _moments(showing: ShownExploration) -> Array:
    """Seconds of the panels: `MOMENTS` of the exploration, or of what is left of it once a map holds anything."""
    end = float(showing.seconds[-1])
    solid = np.flatnonzero((showing.occupancy > 0.5).any(axis=(1, 2, 3)))
    first = float(showing.seconds[showing.step[solid[0]] - 1]) if len(solid) else 0.0
    moments = np.array(MOMENTS)
    if first <= moments[0] * end:
        return moments * end
    return np.round(first + (moments - moments[0]) / (1.0 - moments[0]) * (end - first), 1)


def probability_bar(figure: Figure, panels: np.ndarray) -> None:
    """Say what the colours of voxels mean.

    Args:
        figure: to draw into.
        panels: beside which it is.
    """
    mappable = ScalarMappable(Normalize(0.5, 1.0), OCCUPANCY)
    figure.colorbar(mappable, ax=panels, label="probability that it is solid", shrink=0.6, aspect=25)
