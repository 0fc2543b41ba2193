"""Figure 5 of the paper: the map of each shape at each noise, after a long exploration."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from haptic_env.hand import Hand
from haptic_lab.figures import isometric
from haptic_lab.figures.figure2 import map_table
from haptic_lab.figures.figure4 import probability_bar
from haptic_lab.figures.isometric_view import NEAR
from haptic_lab.figures.paper_figure import WIDTH, Find, PaperFigure, Wanted
from haptic_lab.style import as_drawn, colours_of, titles_of

SIGMAS = (1.0, 2.0, 3.0, 5.0)


def wanted(shapes: Sequence[str]) -> Wanted:
    """Choose every shape at every noise.

    Args:
        shapes: that there are.

    Returns:
        Shapes and sigmas, each with each.
    """
    return [(shape, sigma) for shape in shapes for sigma in SIGMAS]


def draw(wanted: Wanted, find: Find, hand: Hand) -> PaperFigure:
    """Draw the map at the end of each exploration.

    Args:
        wanted: what `wanted` returns.
        find: reads an exploration.
        hand: that explored.

    Returns:
        A row for each shape, a column for each noise.
    """
    shapes = list(dict.fromkeys(shape for shape, _ in wanted))
    colours, titles = colours_of(shapes), titles_of(shapes)
    figure = Figure(figsize=(WIDTH, 0.5 + 1.4 * len(shapes)), layout="constrained")
    panels = figure.subplots(len(shapes), len(SIGMAS), squeeze=False)
    tables = []
    for axes, (shape, sigma) in zip(panels.ravel(), wanted, strict=True):
        showing = find(shape, sigma)
        occupancy = showing.occupancy[-1].astype(float)
        above = f"σ = {sigma:g}°" if shape == shapes[0] else ""
        scale = 20.0 if axes is panels[0, 0] else 0.0
        isometric.draw_scene(axes, occupancy, showing.grid, showing.solid, NEAR, above, scale)
        if sigma == SIGMAS[0]:
            axes.set_ylabel(as_drawn(titles[shape]), color=colours[shape], fontsize=9, fontweight="bold")
        tables.append(map_table(occupancy, occupancy > 0.5, showing).assign(shape=shape, sigma_deg=sigma))
    probability_bar(figure, panels)
    figure.suptitle(f"What {showing.seconds[-1]:g} s of blind touch have mapped", fontsize=9, fontweight="bold")
    return PaperFigure(figure, pd.concat(tables))
