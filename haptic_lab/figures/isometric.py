"""The scene in parallel projection, so that a millimetre is as long everywhere: object, voxels, and the hand as the
cloud of its possible poses.

Shapes: M points, L links, J joints, D poses, V voxels, (H, W) pixels. Lengths in millimetres about the middle of the
map; `depth` grows towards the viewer. Voxels and outlines are vectors, what is shaded or blurred is an image.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from numpy.typing import ArrayLike, NDArray

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.shapes import Solid
from haptic_lab.panels import MM
from haptic_lab.style import HAND, OCCUPANCY, OUTLINE, TRUTH
from observer.kinematics import link_frames, tree_of

PIXEL = 0.5
FAR = 200.0
HIT = 0.1  # so near a line of sight has met the surface
LIGHT = np.array([-0.1, -0.6, 0.8])  # from where, as long as 1 about
FACE_SHADE = (0.72, 0.86, 1.0)  # of the faces across x, y and z
BEHIND, HAND_BEHIND, OBJECT, BEFORE, HAND_BEFORE, MARKS = 1, 2, 3, 4, 5, 6  # what covers what


@dataclass(frozen=True)
class IsometricView:
    """From where a scene is seen, without perspective.

    Attributes:
        half: of the picture's width and height, mm.
        middle: of the picture, mm from the scene's.
        azimuth: degrees about z from +x.
        elevation: degrees above the horizon.
    """

    half: tuple[float, float]
    middle: tuple[float, float] = (0.0, 0.0)
    azimuth: float = -62.0
    elevation: float = 22.0

    @classmethod
    def around(cls, grid: Grid) -> IsometricView:
        """See all that the hand may reach.

        Args:
            grid: of the map.

        Returns:
            The view.
        """
        edge = float(grid.extent.max()) * MM
        return cls(half=(0.6 * edge, 0.47 * edge), middle=(0.0, 0.015 * edge))

    @property
    def axes(self) -> Array:
        """(3, 3): the directions to the right, up, and towards the viewer."""
        a, e = np.deg2rad([self.azimuth, self.elevation])
        towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.stack([right, np.cross(towards, right), towards])

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom, top."""
        (u, v), (across, up) = self.middle, self.half
        return u - across, u + across, v - up, v + up

    def project(self, points: ArrayLike) -> Array:
        """Find where points appear.

        Args:
            points: (..., 3) mm from the middle of the grid.

        Returns:
            (..., 3) mm: to the right, up, and towards the eye.
        """
        return np.asarray(points) @ self.axes.T

    def pixels(self) -> tuple[Array, Array]:
        """Find where pixels are.

        Returns:
            The middles of the columns (W,) and of the rows (H,), mm.
        """
        left, right, bottom, top = self.extent
        return np.arange(left + 0.5 * PIXEL, right, PIXEL), np.arange(bottom + 0.5 * PIXEL, top, PIXEL)


NEAR = IsometricView(half=(44.0, 40.0))  # the object alone


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
    axes: Axes, occupancy: Array, grid: Grid, solid: Solid, view: IsometricView, title: str = "", scale: float = 20.0
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
    depth, shade, gap = _seen(solid, tuple(grid.centre.tolist()), view)
    image = np.ones((*depth.shape, 4))
    image[..., :3] = np.array(to_rgb(TRUTH)) * shade[..., None]
    image[..., 3] = opacity * np.isfinite(depth)
    axes.imshow(image, origin="lower", extent=view.extent, zorder=OBJECT, interpolation="bilinear")
    axes.contour(*view.pixels(), gap, levels=[0.6 * PIXEL], colors=[OUTLINE], linewidths=0.7, zorder=OBJECT)


def draw_voxels(
    axes: Axes, chosen: NDArray[np.bool_], colours: Array, grid: Grid, view: IsometricView, solid: Solid | None = None
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
        front = _depth_at(_seen(solid, tuple(grid.centre.tolist()), view)[0], places, view)
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
                corners = centres[v] + 0.5 * edge * _face(axis, towards[axis])
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
    behind, before = _cloud(hand, poses, grid, view, solid)
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
    (_, _), (cover, _) = _cloud(hand, pose[None], grid, view, None)
    axes.contour(*view.pixels(), cover, levels=[0.5], colors=[OUTLINE], linewidths=0.8, linestyles="--", zorder=MARKS)


def _cloud(
    hand: Hand, poses: Array, grid: Grid, view: IsometricView, solid: Solid | None
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Behind `solid` and before it: in how many of the `poses` (D, J) a pixel is covered (H, W), and how lit."""
    columns, rows = view.pixels()
    shape = len(rows), len(columns)
    front = np.full(shape, -np.inf)
    if solid is not None:
        front = _seen(solid, tuple(grid.centre.tolist()), view)[0]
    sums = np.zeros((2, 2, *shape))  # behind and before; covered and lit
    tree = tree_of(hand)
    for pose in poses:
        position, rotation = link_frames(tree, pose)
        nearest, light, cover = np.full(shape, -np.inf), np.zeros(shape), np.zeros(shape)
        for index, link in enumerate(hand.links):
            ends = np.stack([position[index], position[index] + link.length * rotation[index][:, 2]]) - grid.centre
            _capsule(nearest, light, cover, view.project(ends * MM), link.radius * MM, columns, rows)
        for side, mine in enumerate((nearest < front, nearest >= front)):
            sums[side, 0] += mine * cover
            sums[side, 1] += mine * cover * light
    sums /= len(poses)
    return (sums[0, 0], sums[0, 1]), (sums[1, 0], sums[1, 1])


def _capsule(
    nearest: Array, light: Array, cover: Array, ends: Array, radius: float, columns: Array, rows: Array
) -> None:
    """Put one link, from `ends[0]` to `ends[1]` (projected), over what is farther away. In parallel projection a
    capsule is the flat one about the projected bone; its depth is taken as if the bone lay in the picture's plane."""
    low, high = ends[:, :2].min(axis=0) - radius - PIXEL, ends[:, :2].max(axis=0) + radius + PIXEL
    window = (
        slice(*np.searchsorted(rows, [low[1], high[1]])),
        slice(*np.searchsorted(columns, [low[0], high[0]])),
    )
    u, v = columns[None, window[1]], rows[window[0], None]
    along = ends[1] - ends[0]
    square = max(float(along[:2] @ along[:2]), 1e-9)
    t = np.clip(((u - ends[0, 0]) * along[0] + (v - ends[0, 1]) * along[1]) / square, 0.0, 1.0)
    distance = np.hypot(u - ends[0, 0] - t * along[0], v - ends[0, 1] - t * along[1])
    height = np.sqrt(np.maximum(radius**2 - distance**2, 0.0))
    depth = ends[0, 2] + t * along[2] + height
    share = np.clip((radius - distance) / PIXEL + 0.5, 0.0, 1.0)  # of a pixel at the rim
    cover[window] = np.maximum(cover[window], share)
    here = (share > 0) & (depth > nearest[window])
    nearest[window][here] = depth[here]
    light[window][here] = (0.6 + 0.45 * height / radius)[here]


@lru_cache(maxsize=32)
def _seen(solid: Solid, centre: tuple[float, float, float], view: IsometricView) -> tuple[Array, Array, Array]:
    """March spheres along each line of sight.

    Args:
        solid: that is seen.
        centre: m, middle of the scene.
        view: of the scene.

    Returns:
        Depth of its front, -inf beside it, how lit it is, and how far each line of sight passes it; each (H, W).

    References:
        Hart 1996, The Visual Computer 12, 527-545.
    """
    columns, rows = view.pixels()
    right, up, towards = view.axes
    start = columns[None, :, None] * right + rows[:, None, None] * up
    depth = np.full(start.shape[:2], FAR)

    def distance(depths: Array, offset: ArrayLike = 0.0) -> Array:
        return solid.signed_distance((start + depths[..., None] * towards + offset) / MM + centre) * MM

    gap = np.full(depth.shape, np.inf)
    for _ in range(80):
        free = distance(depth)
        gap = np.minimum(gap, free)
        depth -= np.where(depth > -FAR, np.maximum(free, 0.0), 0.0)
    hit = gap < HIT
    normal = np.stack([distance(depth, 0.2 * axis) - distance(depth, -0.2 * axis) for axis in np.eye(3)], axis=-1)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
    light = normal @ LIGHT
    return np.where(hit, depth, -np.inf), 0.68 + 0.4 * np.clip(light, -0.5, 1.0), gap


def _depth_at(depth: Array, places: Array, view: IsometricView) -> Array:
    """(M,) what `depth` (H, W) says at the projected `places` (M, 3)."""
    left, _, bottom, _ = view.extent
    column = ((places[:, 0] - left) / PIXEL).astype(int).clip(0, depth.shape[1] - 1)
    row = ((places[:, 1] - bottom) / PIXEL).astype(int).clip(0, depth.shape[0] - 1)
    return depth[row, column]


def _face(axis: int, sign: int) -> Array:
    """(4, 3) corners of a face of the cube [-1, 1]³."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    return np.insert(square, axis, sign, axis=1)
