"""A hand at rest with its patches: capsules whose skin is coloured by patch, about the place of the object."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from haptic_env.arrays import Array
from haptic_env.hand import USUAL_SIZE, Hand
from haptic_env.patches import Link
from haptic_lab.style import OUTLINE

VIEWS = (("from the front", 20.0, -75.0), ("from the side", 20.0, 15.0), ("from above", 89.9, -90.0))
COLOURS = np.array(
    [[0x56, 0xB4, 0xE9], [0xE6, 0x9F, 0x00], [0x00, 0x9E, 0x73], [0xCC, 0x79, 0xA7], [0xF0, 0xE4, 0x42]]
) / 255.0  # fmt: skip
NUMB = (0.82, 0.80, 0.78)
ALONG, AROUND, CAP = 8, 24, 5  # quadrilaterals of a capsule, and of each of its caps
DOTS = 90  # of one geom
ARROW = 0.02  # m, of each axis of the world
LIGHT = np.array([0.3, -0.5, 0.81])


def draw(hand: Hand, title: str, outlines: Iterable[Array] = ()) -> Figure:
    """Draw a hand.

    Args:
        hand: at rest.
        title: of the picture.
        outlines: (M, 3) m in the world, of the geoms that capsules stand for.

    Returns:
        The picture.
    """
    data = hand.at_rest()
    faces, colours = [], []
    for index, link in enumerate(hand.links):
        turn = data.xmat[hand.link_bodies[index]].reshape(3, 3)
        corners = _capsule(link)
        middle = corners.mean(axis=1)
        patch = hand.patches.locate(np.full(len(middle), index), middle)
        within = patch - int(hand.patches.first[index])
        shade = 0.72 + 0.28 * np.clip(_normals(corners) @ turn.T @ LIGHT, 0.0, 1.0)
        base = np.where((patch >= 0)[:, None], COLOURS[within % len(COLOURS)], NUMB)
        colours.append(base * shade[:, None])
        faces.append(data.xpos[hand.link_bodies[index]] + corners @ turn.T)
    every, tint = np.concatenate(faces), np.concatenate(colours)
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    figure.suptitle(title, fontsize=11, fontweight="bold")
    dots = [_thinned(outline) for outline in outlines]
    shown = np.concatenate([every.reshape(-1, 3), hand.grasp_centre[None]])
    low, high = shown.min(axis=0), shown.max(axis=0)
    for place, (name, elevation, azimuth) in enumerate(VIEWS):
        axes = figure.add_subplot(1, len(VIEWS), place + 1, projection="3d", computed_zorder=False)
        axes.add_collection3d(Poly3DCollection(every, facecolors=tint, edgecolors="none", zorder=1))
        for each in dots:
            axes.scatter(*each.T, s=1.5, c=OUTLINE, linewidths=0.0, depthshade=False, zorder=2)
        for edge in _box(hand.grasp_centre, USUAL_SIZE):
            axes.plot(*edge.T, color=OUTLINE, linewidth=0.7, linestyle=":", zorder=3)
        reach = 0.5 * float((high - low).max())
        for set_limits, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), 0.5 * (low + high), strict=True):
            set_limits(centre - reach, centre + reach)
        axes.set_box_aspect((1, 1, 1), zoom=1.25)
        axes.view_init(elevation, azimuth)
        axes.set_proj_type("ortho")
        axes.set_title(name, fontsize=9)
        axes.set_axis_off()
        corner = 0.5 * (low + high) + reach * np.array([-0.95, -0.95, -0.95])
        for axis, letter in zip(np.eye(3), "xyz", strict=True):
            axes.plot(*np.stack([corner, corner + ARROW * axis]).T, color=OUTLINE, linewidth=1.0, zorder=4)
            if axis @ _sight(elevation, azimuth) < 0.9:
                axes.text(*(corner + 1.3 * ARROW * axis), letter, fontsize=7, ha="center", va="center")
    marks = [
        Line2D([], [], color=OUTLINE, linestyle=":", linewidth=0.9, label=f"an object of {1e3 * USUAL_SIZE:.0f} mm"),
        Line2D([], [], color=OUTLINE, linewidth=1.0, label=f"axes of the world, {1e3 * ARROW:.0f} mm"),
    ]
    if hand.patches.numb.any():
        marks.append(Line2D([], [], color=NUMB, marker="s", linestyle="none", label="feels nothing"))
    if dots:
        told = "what capsules stand for"
        marks.append(Line2D([], [], color=OUTLINE, marker=".", markersize=3, linestyle="none", label=told))
    figure.legend(handles=marks, loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _sight(elevation: float, azimuth: float) -> Array:
    """(3,): where the viewer is."""
    up, turn = np.deg2rad([elevation, azimuth])
    return np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])


def _capsule(link: Link) -> Array:
    """(F, 4, 3) m: the corners of the quadrilaterals of a link, in its frame."""
    polar = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2 * CAP + 1)
    low = [(link.radius * np.cos(each), link.radius * np.sin(each)) for each in polar[: CAP + 1]]
    high = [(link.radius * np.cos(each), link.length + link.radius * np.sin(each)) for each in polar[CAP:]]
    side = [(link.radius, z) for z in np.linspace(0.0, link.length, ALONG + 1)[1:-1]]
    profile = np.array([*low, *side, *high])
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND + 1) + np.pi / AROUND
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    points = np.empty((len(profile), AROUND + 1, 3))
    points[..., :2], points[..., 2] = profile[:, None, :1] * ring, profile[:, None, 1]
    corners = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]], axis=2)
    return corners.reshape(-1, 4, 3)


def _normals(corners: Array) -> Array:
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12))


def _thinned(points: Array) -> Array:
    return points[:: max(1, len(points) // DOTS)]


def _box(centre: Array, size: float) -> list[Array]:
    corners = centre + 0.5 * size * (np.indices((2, 2, 2)).reshape(3, -1).T * 2 - 1)
    pairs = [(a, b) for a in range(8) for b in range(a) if np.isclose(np.abs(corners[a] - corners[b]).sum(), size)]
    return [corners[[a, b]] for a, b in pairs]
