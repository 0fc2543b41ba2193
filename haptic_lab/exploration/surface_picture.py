"""The picture of a surface that was felt: coloured by how surely it is known, beside the true object.

Shapes: V vertices, F faces, M places. In millimetres about the middle of both.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgb
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.shapes import Solid
from haptic_lab.style import TRUTH
from observer.surface import Surface
from observer.surface.metrics import MM, facets, true_mesh

SURE, UNSURE = "#08519C", "#F1E9DA"
CERTAINTY = LinearSegmentedColormap.from_list(
    "certainty", [(0.0, SURE), (0.25, "#4A98C9"), (0.6, "#C9D8DC"), (1.0, UNSURE)]
)
LIMIT = 10.0  # mm of SD, from which on nothing is known
TOUCHED = "#D94801"
VIEWS = {"from one side": -55.0, "from the other side": 125.0}  # title: azimuth, degrees
HEIGHT = 22.0  # degrees from which it is seen
LIGHT = np.array([0.35, -0.45, 0.82])
DIMMEST = 0.55  # of a face that the light does not reach


def picture(surface: Surface, solid: Solid, touched: Array, title: str) -> Figure:
    """Draw a surface from two sides, and the true object with what was touched of it from the same.

    Args:
        surface: that is drawn.
        solid: the true object.
        touched: (M, 3) m, places of it.
        title: says what it shows.

    Returns:
        The figure.
    """
    figure = Figure(figsize=(10, 8.0), layout="constrained")
    true_vertices, true_faces = true_mesh(solid)
    every = np.concatenate([surface.vertices, true_vertices])
    middle = 0.5 * (every.min(axis=0) + every.max(axis=0))
    reach = 0.9 * MM * float(np.linalg.norm(every - middle, axis=1).max())
    scale = Normalize(0.0, LIMIT)
    colours = CERTAINTY(scale(MM * surface.std[surface.faces].mean(axis=1)))[:, :3]
    grey = np.tile(to_rgb(TRUTH), (len(true_faces), 1))
    panels: list[Any] = []
    for column, (side, azimuth) in enumerate(VIEWS.items()):
        axes: Any = figure.add_subplot(2, 2, 1 + column, projection="3d")
        _draw(axes, surface.vertices - middle, surface.faces, colours, azimuth)
        axes.set_title(f"felt: {side}")
        panels.append(axes)
        below: Any = figure.add_subplot(2, 2, 3 + column, projection="3d")
        _draw(below, true_vertices - middle, true_faces, grey, azimuth)
        _mark(below, touched - middle, azimuth, solid, middle)
        below.set_title(f"true, and where it was touched: {side}")
        panels.append(below)
    for axes in panels:
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach))
        axes.set_box_aspect((1, 1, 1), zoom=1.4)
        axes.set_axis_off()
    bar = figure.colorbar(ScalarMappable(scale, CERTAINTY), ax=panels[::2], location="right", shrink=0.7, extend="max")
    bar.set_label("SD (mm): blue is known, pale is guessed")
    figure.suptitle(title, fontsize=12, fontweight="bold")
    return figure


def _draw(axes: Any, vertices: Array, faces: NDArray[np.int64], colours: Array, azimuth: float) -> None:
    """Draw a mesh, lit from over the shoulder of whoever looks; `colours` (F, 3)."""
    axes.set_proj_type("ortho")
    axes.computed_zorder = False  # marks cover the mesh that they are on
    axes.view_init(elev=HEIGHT, azim=azimuth)
    turn = np.deg2rad(azimuth - VIEWS["from one side"])
    spin = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    light = spin @ LIGHT / np.linalg.norm(LIGHT)
    shade = DIMMEST + (1.0 - DIMMEST) * np.clip(facets(vertices, faces).normal @ light, 0.0, 1.0)
    drawn = np.clip(colours * shade[:, None], 0.0, 1.0)
    axes.add_collection3d(
        Poly3DCollection(MM * vertices[faces], facecolors=drawn, edgecolors=drawn, linewidths=0.4, rasterized=True)
    )


def _mark(axes: Any, places: Array, azimuth: float, solid: Solid, middle: Array) -> None:
    """Mark the places (M, 3) m about the middle that can be seen, which matplotlib does not find out."""
    low, high = np.deg2rad(HEIGHT), np.deg2rad(azimuth)
    towards = np.array([np.cos(low) * np.cos(high), np.cos(low) * np.sin(high), np.sin(low)])
    on_the_way = places[:, None] + np.linspace(0.003, 0.1, 40)[:, None] * towards
    seen = (solid.signed_distance(on_the_way + middle) > -1e-3).all(axis=1)
    shown = MM * (places[seen] + 0.001 * towards)
    axes.scatter(*shown.T, s=7, color=TOUCHED, depthshade=False, zorder=10)
