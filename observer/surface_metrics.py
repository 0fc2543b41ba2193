"""How well a map fits the object that is there. Metrics may read the truth; observers never do.

Shapes: T steps, J joints, P patches, M places, (X, Y, Z) voxels. Angles in radians, lengths in metres. What cannot be
said (a share of nothing) is NaN. What is given must be finite, real, of these shapes and, where it is a probability, in
[0, 1]: else all raise `ValueError`, which quotes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.patches import SkinPoints
from haptic_env.pose import Pose
from haptic_env.shapes.base import Solid
from observer import edge
from observer.kinematics import Tree, placed_points
from observer.swept_volume import LEAST_SPACING, neighbourhood, posed, swept

OCCUPIED = 0.5
FAR = 1e6  # metres
TOUCH_TOLERANCE = 0.002  # metres: skin further from the surface than this rang falsely


class SurfaceScore(NamedTuple):
    """Shares in [0, 1].

    Attributes:
        precision: of the occupied voxels, those near the surface.
        recall: of the touched places, those near an occupied voxel.
        f_score: their harmonic mean.
    """

    precision: float
    recall: float
    f_score: float


def touched_places(
    hand: Hand,
    joint_angles: ArrayLike,
    contacts: ArrayLike,
    solid: Solid,
    spacing: float = 0.002,
    roots: Sequence[Pose] | None = None,
) -> Array:
    """Find where the skin really touched a solid.

    At each step it is the point of every patch that rang nearest to the surface; a patch whose skin is further than
    `TOUCH_TOLERANCE` away rang falsely and is left out.

    Args:
        hand: with J joints and P patches.
        joint_angles: (T, J) rad, the true ones.
        contacts: (T, P).
        solid: that was touched.
        spacing: m, edge of cubes of which each has one place at most.
        roots: (T,) where the hand as a whole was in the frame of `solid`, if it moved.

    Returns:
        (M, 3) m.

    Raises:
        ValueError: for what is none of these.
    """
    edge.world(hand=hand, solid=solid)
    skin = hand.patches.surface(validate.number("spacing", spacing, LEAST_SPACING, 1.0, unit="m"))
    found, steps = [], list(posed(hand, joint_angles, roots))
    for (tree, angles), rang in zip(
        steps, validate.binary("contacts", contacts, (len(steps), len(hand.patches))), strict=True
    ):
        if rang.any():
            found.append(touched_at_once(skin, tree, angles, rang, solid))
    places = np.concatenate(found) if found else np.empty((0, 3))
    cubes = np.floor(places / spacing).astype(np.int64)
    return places[np.sort(np.unique(cubes, axis=0, return_index=True)[1])]


def touched_at_once(skin: SkinPoints, tree: Tree, joint_angles: Array, rang: NDArray[np.bool_], solid: Solid) -> Array:
    """Find where the skin really touched a solid at one step, as `touched_places` does at each.

    Args:
        skin: points all over it.
        tree: of the hand.
        joint_angles: (J,) rad, the true ones.
        rang: (P,) patches.
        solid: that was touched.

    Returns:
        (M, 3) m, one place at most of each patch.
    """
    mine = np.flatnonzero(rang[skin.patch])
    points = placed_points(tree, joint_angles, skin.points[mine], skin.link[mine])
    gap = np.abs(solid.signed_distance(points))
    order = np.lexsort((gap, skin.patch[mine]))  # patch by patch, the nearest point first
    nearest = order[np.unique(skin.patch[mine][order], return_index=True)[1]]
    return np.asarray(points[nearest[gap[nearest] <= TOUCH_TOLERANCE]])


def surface_precision(occupancy: Array, grid: Grid, solid: Solid, voxels: float = 1.0) -> float:
    """Tell how much of what a map holds for occupied is near the surface.

    Args:
        occupancy: (X, Y, Z) probabilities.
        grid: of the map.
        solid: that is there.
        voxels: distance.

    Returns:
        Share of the occupied voxels whose centre is within that distance of the surface; 0 where none is occupied.

    Raises:
        ValueError: for what is none of these.
    """
    edge.world(grid=grid, solid=solid)
    centres = grid.centres()[_map(occupancy, grid) > OCCUPIED]
    near = np.abs(solid.signed_distance(centres)) <= _length(voxels, grid)
    return float(near.mean()) if near.size else 0.0


def surface_recall(occupancy: Array, grid: Grid, places: Array, voxels: float = 1.0) -> float:
    """Tell how many places a map has found.

    Args:
        occupancy: (X, Y, Z) probabilities.
        grid: of the map.
        places: (M, 3) m.
        voxels: distance.

    Returns:
        Share of the places with the centre of an occupied voxel within that distance; NaN without a place.

    Raises:
        ValueError: for what is none of these.
    """
    edge.world(grid=grid)
    where = _places("places", places)
    occupied, near = _map(occupancy, grid) > OCCUPIED, _length(voxels, grid)
    if len(where) == 0:
        return float("nan")
    if not occupied.any():
        return 0.0
    distance, _ = cKDTree(grid.centres()[occupied]).query(where)
    return float((distance <= near).mean())


def surface_score(occupancy: Array, grid: Grid, solid: Solid, touched: Array, voxels: float = 1.0) -> SurfaceScore:
    """Hold a map against the surface, and against what was touched of it.

    Args:
        occupancy: (X, Y, Z) probabilities.
        grid: of the map.
        solid: that is there.
        touched: (M, 3) m.
        voxels: distance.

    Returns:
        Precision, recall and F-score.

    Raises:
        ValueError: for what is none of these.
    """
    precision = surface_precision(occupancy, grid, solid, voxels)
    recall = surface_recall(occupancy, grid, _places("touched", touched), voxels)
    total = precision + recall
    return SurfaceScore(precision, recall, 2 * precision * recall / total if total != 0 else 0.0)


def surface_coverage(occupancy: Array, grid: Grid, solid: Solid, voxels: float = 1.0) -> float:
    """Tell how much of the whole surface a map has found.

    Args:
        occupancy: (X, Y, Z) probabilities.
        grid: of the map.
        solid: that is there.
        voxels: distance.

    Returns:
        Share of the voxels that the surface passes through with an occupied voxel within that distance.

    Raises:
        ValueError: for what is none of these.
    """
    return surface_recall(occupancy, grid, surface_places(solid, grid), voxels)


def surface_places(solid: Solid, grid: Grid) -> Array:
    """Find the voxels that a surface passes through.

    Args:
        solid: with the surface.
        grid: of the voxels.

    Returns:
        (M, 3) m, their centres.

    Raises:
        ValueError: for what is none of these.
    """
    edge.world(grid=grid, solid=solid)
    centres = grid.centres()
    return centres[np.abs(solid.signed_distance(centres)) <= _length(0.5, grid)]


def reachable(
    hand: Hand, joint_angles: ArrayLike, grid: Grid, roots: Sequence[Pose] | None = None
) -> NDArray[np.bool_]:
    """Find where the skin could have felt what is there: what the hand swept, and the 26 neighbours of each voxel.

    Args:
        hand: with J joints.
        joint_angles: (T, J) rad, the true ones.
        grid: of the voxels.
        roots: (T,) where the hand as a whole was, if it moved.

    Returns:
        (X, Y, Z) which.

    Raises:
        ValueError: for what is none of these.
    """
    return neighbourhood(swept(hand, joint_angles, grid, roots))


def reached_into(solid: Solid, grid: Grid) -> NDArray[np.bool_]:
    """Find the voxels whose centre lies inside a solid, or within half a voxel of its surface.

    Args:
        solid: that is there.
        grid: of the voxels.

    Returns:
        (X, Y, Z) which.

    Raises:
        ValueError: for what is none of these.
    """
    edge.world(grid=grid, solid=solid)
    return np.asarray(solid.signed_distance(grid.centres()) <= _length(0.5, grid))


def _length(voxels: float, grid: Grid) -> float:
    """Metres; a hair more, so that rounding does not decide about what is exactly so far away (neighbours are)."""
    return validate.number("voxels", voxels, 0.0, 1e6) * grid.resolution * (1 + 1e-6)


def _places(what: str, value: ArrayLike) -> Array:
    places = validate.numbers(what, value, 2, bound=FAR)
    if places.shape[1] != 3:
        raise ValueError(f"{what} must be of shape (M, 3) in m, got shape {places.shape}")
    return places


def _map(occupancy: ArrayLike, grid: Grid) -> Array:
    result = validate.probabilities("occupancy", occupancy, 3)
    if result.shape != grid.shape:
        raise ValueError(f"occupancy must be of the grid's shape {grid.shape}, got {result.shape}")
    return result
