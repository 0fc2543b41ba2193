"""The scene in parallel projection, so that a millimetre is as long everywhere: object, voxels, and the hand as the
cloud of its possible poses.

Shapes: M points, L links, J joints, D poses, V voxels, (H, W) pixels. Lengths in millimetres about the middle of the
map; `depth` grows towards the viewer. Voxels and outlines are vectors, what is shaded or blurred is an image.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.shapes import Solid
from haptic_lab.figures.isometric_view import PIXEL, IsometricView, cloud, depth_at, face, seen
from haptic_lab.panels import MM
from haptic_lab.style import HAND, OCCUPANCY, OUTLINE, TRUTH

FACE_SHADE = (0.72, 0.86, 1.0)  # of the faces across x, y and z
BEHIND, HAND_BEHIND, OBJECT, BEFORE, HAND_BEFORE, MARKS = 1, 2, 3, 4, 5, 6  # what covers what


def prepare(axes: Axes, view: IsometricView, title: str = "", scale: float = 20.0) -> None:
    """Make an empty scene with a bar that says how large it is.

    Args:
        axes: to draw into.
        view: of the scene.
        title: of the panel.
        scale: mm, length of the bar.
    """
    left, right, bottom, top = view.extent
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", title=title, xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    if scale > 0:
        start, height = left + 4.0, bottom + 6.0
        axes.plot([start, start + scale], [height, height], color=OUTLINE, linewidth=2, zorder=MARKS)
        axes.text(start + 0.5 * scale, height - 1.5, f"{scale:g} mm", ha="center", va="top", fontsize=7)


def draw_scene(
    axes: Axes,
    occupancy: Array,
    grid: Grid,
    solid: Solid,
    view: IsometricView,
    title: str = "",
    scale: float = 20.0,
) -> None:
    """Draw the map over the true shape.

    Args:
        axes: to draw into.
        occupancy: (X, Y, Z) probabilities.
        grid: of the map.
        solid: the true shape.
        view: of the scene.
        title: of the panel.
        scale: mm, length of the bar.
    """
    prepare(axes, view, title, scale)
    draw_solid(axes, solid, grid, view)
    draw_map(axes, occupancy, grid, view, solid)


def draw_solid(axes: Axes, solid: Solid, grid: Grid, view: IsometricView, opacity: float = 0.5) -> None:
    """Draw the true shape, shaded, with its outline.

    Args:
        axes: to draw into.
        solid: the true shape.
        grid: whose centre is the scene's middle.
        view: of the scene.
        opacity: in [0, 1].
    """
    depth, shade, gap = seen(solid, tuple(grid.centre.tolist()), view)
    image = np.ones((*depth.shape, 4))
    image[..., :3] = np.array(to_rgb(TRUTH)) * shade[..., None]
    image[..., 3] = opacity * np.isfinite(depth)
    axes.imshow(image, origin="lower", extent=view.extent, zorder=OBJECT, interpolation="bilinear")
    axes.contour(*view.pixels(), gap, levels=[0.6 * PIXEL], colors=[OUTLINE], linewidths=0.7, zorder=OBJECT)


def draw_voxels(
    axes: Axes,
    chosen: NDArray[np.bool_],
    colours: Array,
    grid: Grid,
    view: IsometricView,
    solid: Solid | None = None,
) -> None:
    """Draw voxels as cubes.

    Args:
        axes: to draw into.
        chosen: (X, Y, Z) which are drawn.
        colours: (X, Y, Z, 3) in [0, 1].
        grid: of the voxels.
        view: of the scene.
        solid: through which those behind its front are seen; None: nothing is in front.
    """
    cells = np.argwhere(chosen)
    if len(cells) == 0:
        return
    edge = grid.resolution * MM
    centres = (cells + 0.5) * edge - 0.5 * grid.extent * MM
    places = view.project(centres)
    behind = np.zeros(len(cells), dtype=bool)
    if solid is not None:
        front = depth_at(seen(solid, tuple(grid.centre.tolist()), view)[0], places, view)
        behind = places[:, 2] + 0.5 * edge < front
    towards = np.sign(view.axes[2]).astype(int)
    padded = np.pad(chosen, 1)
    for hidden, level in ((True, BEHIND), (False, BEFORE)):
        mine = np.flatnonzero(behind == hidden)
        mine = mine[np.argsort(places[mine, 2])]  # the far ones first
        polygons, faces = [], []
        for v in mine:
            for axis in range(3):
                beside = cells[v] + 1
                beside[axis] += towards[axis]
                if padded[tuple(beside)]:
                    continue  # another cube covers this face
                corners = centres[v] + 0.5 * edge * face(axis, towards[axis])
                polygons.append(view.project(corners)[:, :2])
                faces.append(FACE_SHADE[axis] * colours[tuple(cells[v])])
        axes.add_collection(
            PolyCollection(polygons, facecolors=faces, edgecolors=[(0.2, 0.1, 0.1)], linewidths=0.25, zorder=level)
        )


def draw_map(axes: Axes, occupancy: Array, grid: Grid, view: IsometricView, solid: Solid | None = None) -> None:
    """Draw the voxels that are more probably solid than not, the darker the surer.

    Args:
        axes: to draw into.
        occupancy: (X, Y, Z) probabilities.
        grid: of the map.
        view: of the scene.
        solid: as `draw_voxels`'s.
    """
    shown = OCCUPANCY(np.clip(2 * occupancy - 1, 0.05, 1.0))
    draw_voxels(axes, occupancy > 0.5, shown[..., :3], grid, view, solid)


def draw_hand(
    axes: Axes,
    hand: Hand,
    poses: Array,
    grid: Grid,
    view: IsometricView,
    solid: Solid | None = None,
    opacity: float = 1.0,
) -> None:
    """Draw a hand in many poses at once: each pixel is as opaque as a finger is probably there.

    Args:
        axes: to draw into.
        hand: that is drawn.
        poses: (D, J) rad.
        grid: whose centre is the scene's middle.
        view: of the scene.
        solid: that hides what is behind it; None: nothing does.
        opacity: in [0, 1], of a pixel where a finger surely is.
    """
    behind, before = cloud(hand, poses, grid, view, solid)
    for (cover, light), level in ((behind, HAND_BEHIND), (before, HAND_BEFORE)):
        image = np.ones((*cover.shape, 4))
        image[..., :3] = np.array(to_rgb(HAND)) * (light / np.maximum(cover, 1e-9))[..., None]
        image[..., 3] = opacity * cover
        axes.imshow(np.clip(image, 0, 1), origin="lower", extent=view.extent, zorder=level, interpolation="bilinear")


def draw_hand_outline(axes: Axes, hand: Hand, pose: Array, grid: Grid, view: IsometricView) -> None:
    """Draw the outline of a hand.

    Args:
        axes: to draw into.
        hand: that is drawn.
        pose: (J,) rad.
        grid: whose centre is the scene's middle.
        view: of the scene.
    """
    (_, _), (cover, _) = cloud(hand, pose[None], grid, view, None)
    axes.contour(*view.pixels(), cover, levels=[0.5], colors=[OUTLINE], linewidths=0.8, linestyles="--", zorder=MARKS)
