"""The voxels that a hand moved through.

Shapes: T steps, J joints, M points, (X, Y, Z) voxels. Angles in radians, lengths in metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_dilation, generate_binary_structure

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from observer import edge
from observer.kinematics import Tree, placed, placed_points, tree_of
from observer.maps.capsules import lattice_of, voxel_of

LEAST_SPACING = 0.0002  # metres: with less the skin has more points than fit into the memory


def swept(hand: Hand, joint_angles: ArrayLike, grid: Grid, roots: Sequence[Pose] | None = None) -> NDArray[np.bool_]:
    """Find the voxels that a point inside a finger fell into at some step.

    Args:
        hand: with J joints.
        joint_angles: (T, J) rad, the true ones.
        grid: of the voxels.
        roots: (T,) where the hand as a whole was in the frame of the grid, if it moved.

    Returns:
        (X, Y, Z) which.

    Raises:
        ValueError: for what is of other shapes, and for a grid too fine.
    """
    edge.world(hand=hand, grid=grid)
    fine = validate.number("the grid's resolution", grid.resolution, LEAST_SPACING, unit="m")
    inside = hand.patches.volume(0.75 * fine)
    found = np.zeros(grid.shape, dtype=bool)
    for tree, angles in posed(hand, joint_angles, roots):
        _mark(placed_points(tree, angles, inside.points, inside.link), lattice_of(grid), found)
    return found


@kernel()
def _mark(points: Array, lattice: Any, found: NDArray[np.bool_]) -> None:
    """Set `found` (X, Y, Z) where any of `points` (M, 3) m falls."""
    for m in range(len(points)):
        i, j, k, inside = voxel_of(lattice, points[m, 0], points[m, 1], points[m, 2])
        if inside:
            found[i, j, k] = True


def neighbourhood(cells: NDArray[np.bool_], faces: bool = False) -> NDArray[np.bool_]:
    """Add to cells their neighbours.

    Args:
        cells: (X, Y, Z) which.
        faces: whether only the 6 that share a face, not all 26.

    Returns:
        (X, Y, Z) which.

    Raises:
        ValueError: for cells of another shape.
    """
    marked, few = validate.binary("cells", cells), validate.boolean("faces", faces)
    if marked.ndim != 3:
        raise ValueError(f"cells must be of shape (X, Y, Z), got shape {marked.shape}")
    return binary_dilation(marked, generate_binary_structure(3, 1 if few else 3))


def posed(hand: Hand, joint_angles: ArrayLike, roots: Sequence[Pose] | None) -> Iterator[tuple[Tree, Array]]:
    """Follow a hand.

    Args:
        hand: with J joints.
        joint_angles: (T, J) rad.
        roots: (T,) where the hand as a whole was in the frame of the grid, if it moved.

    Yields:
        At each step the tree of the hand where it was, and its angles (J,).

    Raises:
        ValueError: for what is of other shapes.
    """
    tree, angles = tree_of(hand), validate.numbers("joint_angles", joint_angles, 2)
    if angles.shape[1] != hand.joints:
        raise ValueError(f"joint_angles must be of shape (T, {hand.joints}) in rad, got shape {angles.shape}")
    if roots is not None:
        validate.instance("roots", roots, Sequence, "a list of poses")
    known = [None] * len(angles) if roots is None else list(roots)
    if len(known) != len(angles):
        raise ValueError(f"roots must be as many as steps, {len(angles)}, got {len(known)}")
    for each, root in zip(angles, known, strict=True):
        yield placed(tree, edge.root(root)), each
