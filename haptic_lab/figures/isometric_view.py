"""From where a scene is seen, and what is seen from there: depth, light and cover of solids and hands, pixel by pixel.

Shapes: H × W pixels, D poses, J joints. Depths and places in the picture in mm, from the middle of the grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.shapes import Solid
from haptic_lab.panels import MM
from observer.kinematics import link_frames, tree_of

PIXEL = 0.5
FAR = 200.0
HIT = 0.1  # so near a line of sight has met the surface
LIGHT = np.array([-0.1, -0.6, 0.8])  # from where, as long as 1 about


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


def cloud(
    hand: Hand, poses: Array, grid: Grid, view: IsometricView, solid: Solid | None
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """See a hand in many poses at once.

    Args:
        hand: that is seen.
        poses: (D, J) rad.
        grid: whose centre is the scene's middle.
        view: of the scene.
        solid: that parts the hand in what is behind it and what is before it; None: all is before it.

    Returns:
        Of the part behind and of the one before: the share of the poses in which each pixel is covered (H, W), and that
        share times how lit it is (H, W).
    """
    columns, rows = view.pixels()
    shape = len(rows), len(columns)
    front = np.full(shape, -np.inf)
    if solid is not None:
        front = seen(solid, tuple(grid.centre.tolist()), view)[0]
    sums = np.zeros((2, 2, *shape))  # behind and before; covered and lit
    tree = tree_of(hand)
    for pose in poses:
        bones = hand.bones(*link_frames(tree, pose))
        nearest, light, cover = np.full(shape, -np.inf), np.zeros(shape), np.zeros(shape)
        for link, bone in zip(hand.links, bones, strict=True):
            ends = view.project((bone - grid.centre) * MM)
            _capsule(nearest, light, cover, ends, link.radius * MM, columns, rows)
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
def seen(solid: Solid, centre: tuple[float, float, float], view: IsometricView) -> tuple[Array, Array, Array]:
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


def depth_at(depth: Array, places: Array, view: IsometricView) -> Array:
    """Look up depths.

    Args:
        depth: (H, W), of `seen`.
        places: (M, 3), projected.
        view: of the scene.

    Returns:
        (M,) the depth in the pixel of each place.
    """
    left, _, bottom, _ = view.extent
    column = ((places[:, 0] - left) / PIXEL).astype(int).clip(0, depth.shape[1] - 1)
    row = ((places[:, 1] - bottom) / PIXEL).astype(int).clip(0, depth.shape[0] - 1)
    return depth[row, column]


def face(axis: int, sign: int) -> Array:
    """Find a face of the cube [-1, 1]³.

    Args:
        axis: across which it is, 0 to 2.
        sign: 1 or -1, on which side.

    Returns:
        (4, 3) its corners.
    """
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    return np.insert(square, axis, sign, axis=1)
