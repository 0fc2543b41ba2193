"""The signed distance of a solid at the nodes of a grid around it.

Where the distance takes long, of meshes, every node is measured near the surface alone. Farther out only some are, and
what lies between is theirs, linearly: too much by a few tenths of a millimetre, where nothing is felt. Such a field is
kept on disk by what it is of, and read by all processes from the same pages.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from haptic_env import cache, notice
from haptic_env.arrays import Array
from haptic_env.files import atomic
from haptic_env.grid import Grid
from haptic_env.shapes.base import Shape, Solid

Field = NDArray[np.float32]
FIELD_RESOLUTION = 0.0025
AT_ONCE = 2**16  # points whose distance is asked for at once: a shape's own arrays stay small
KEPT, LARGEST_KEPT = 64, 2**20  # fields and nodes of each: the next trial of a sweep has the shapes of the last
COARSEST = 4  # nodes so many apart are all measured
LEVELS = ((2, 0.04), (1, 0.015))  # nodes so many apart, so near to the surface, m
MADE = 1  # changes where fields are made otherwise: those on disk are of no use then
MEASURING = "Measuring distances from objects, once on this machine"
STEP = 0.01  # m by which the reach of what is kept on disk is rounded up, so that other hands find it too


def field_of(shape: Shape, size: tuple[float, float, float], reach: float) -> tuple[Grid, Field]:
    """Measure a solid's signed distance around it.

    Args:
        shape: of the solid.
        size: (3,) m, full extents.
        reach: m, how far from its bounding box to go at least.

    Returns:
        A grid in the solid's frame, and the distance (X, Y, Z) m at the centres of its voxels; not to be changed.
    """
    content = shape.content
    grid = _grid(size, reach, content)
    if content:
        return grid, _remembered(shape, size, grid, content)
    if not shape.exact:  # what was felt in one trial
        return grid, near_surface(shape, size, grid)
    measured = _measured if np.prod(grid.shape) <= LARGEST_KEPT else _measured.__wrapped__
    return grid, measured(shape, size, grid)


def fields_of(solids: Sequence[Solid], reach: float) -> list[tuple[Grid, Field]]:
    """Measure the signed distances of several solids, and tell how far that is where any takes long.

    Args:
        solids: of any size; where they are does not matter.
        reach: as of `field_of`.

    Returns:
        As `field_of`, of each.
    """
    missing = [not _is_kept(solid, reach) for solid in solids]
    made = []
    for number, solid in enumerate(solids):
        if missing[number]:
            notice.tell(MEASURING, sum(missing[:number]), sum(missing))
        made.append(field_of(solid.shape, solid.size, reach))
    if any(missing):
        notice.tell(MEASURING, sum(missing), sum(missing))
    return made


def spread_of(solid: Solid, grid: Grid) -> Field | None:
    """Tell how surely the surface of a solid is known.

    Args:
        solid: of any size; where it is does not matter.
        grid: in its frame.

    Returns:
        (X, Y, Z) m, SD of the place of the surface where it is nearest to the centres of voxels; None: it is known, or
        its distance tells of that.
    """
    return None if solid.shape.exact else _spread(solid.shape, solid.size, grid)


@lru_cache(maxsize=KEPT)
def _spread(shape: Shape, size: tuple[float, float, float], grid: Grid) -> Field | None:
    points = grid.centres().reshape(-1, 3)
    told = [shape.spread(points[k : k + AT_ONCE], np.array(size)) for k in range(0, len(points), AT_ONCE)]
    known = [each.astype(np.float32) for each in told if each is not None]
    return np.concatenate(known).reshape(grid.shape) if len(known) == len(told) else None


def _is_kept(solid: Solid, reach: float) -> bool:
    """Whether the field of a solid is on disk, or need not be."""
    content = solid.shape.content
    return not content or _place(solid.size, _grid(solid.size, reach, content), content).exists()


def _grid(size: tuple[float, float, float], reach: float, content: str) -> Grid:
    if content:
        reach = STEP * np.ceil(reach / STEP - 1e-9)
    return Grid.around(np.zeros(3), np.asarray(size) + 2 * (reach + FIELD_RESOLUTION), FIELD_RESOLUTION)


def _place(size: tuple[float, float, float], grid: Grid, content: str) -> Path:
    """The file of a field in the user's cache folder."""
    told = f"{MADE} {content} {np.round(size, 9).tolist()} {grid}"
    return cache.folder() / "fields" / f"{hashlib.sha256(told.encode()).hexdigest()}.npy"


@lru_cache(maxsize=KEPT)
def _measured(shape: Shape, size: tuple[float, float, float], grid: Grid) -> Field:
    """The distance at every node, slab by slab."""
    x, y, z = _axes(grid)
    result = np.empty(grid.shape, dtype=np.float32)
    thick = max(1, AT_ONCE // (len(y) * len(z)))
    for first in range(0, len(x), thick):
        slab = slice(first, first + thick)
        points = np.stack(np.meshgrid(x[slab], y, z, indexing="ij"), axis=-1)
        result[slab] = shape.signed_distance(points, np.array(size))
    result.flags.writeable = False  # whoever asks next has the same one
    return result


@lru_cache(maxsize=KEPT)
def _remembered(shape: Shape, size: tuple[float, float, float], grid: Grid, content: str) -> Field:
    """The field from the user's cache folder, where it is put if it is not there."""
    place = _place(size, grid, content)
    with contextlib.suppress(OSError, ValueError, EOFError):  # not there, or cut short: it is found again
        return _read(place, grid)
    result = near_surface(shape, size, grid)
    with contextlib.suppress(OSError):  # a full disk costs the time, no more
        place.parent.mkdir(exist_ok=True)
        with atomic(place) as unfinished:
            np.save(unfinished, result)
        return _read(place, grid)
    result.flags.writeable = False
    return result


def _read(place: Path, grid: Grid) -> Field:
    kept = np.load(place, mmap_mode="r", allow_pickle=False)
    if kept.shape != grid.shape or kept.dtype != np.float32:
        raise ValueError(f"{place} holds another field")
    return kept


def near_surface(shape: Shape, size: tuple[float, float, float], grid: Grid) -> Field:
    """Measure the distance finely near the surface, more coarsely the farther out.

    Args:
        shape: of the solid.
        size: (3,) m, full extents.
        grid: in its frame.

    Returns:
        (X, Y, Z) m.
    """
    axes, extents = _axes(grid), np.array(size)
    known, points = _every(COARSEST, axes)
    result = _asked(shape, extents, points)
    for apart, reach in LEVELS:
        nodes, points = _every(apart, axes)
        result, known = RegularGridInterpolator(known, result)(points), nodes
        near = np.abs(result) <= reach
        result[near] = _asked(shape, extents, points[near])
    return result.astype(np.float32)


def _every(apart: int, axes: list[Array]) -> tuple[list[Array], Array]:
    """Nodes so many apart, and the last: places along each of `axes`, and of all (X, Y, Z, 3)."""
    nodes = [axis[np.unique(np.append(np.arange(0, len(axis), apart), len(axis) - 1))] for axis in axes]
    return nodes, np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1)


def _axes(grid: Grid) -> list[Array]:
    """Places (X,), (Y,), (Z,) m of the nodes along each axis."""
    each = [np.arange(count, dtype=np.float64) + 0.5 for count in grid.shape]
    return [low + number * grid.resolution for low, number in zip(grid.origin, each, strict=True)]


def _asked(shape: Shape, extents: Array, points: Array) -> Array:
    """Distances (...) m of points (..., 3), some at a time."""
    flat = points.reshape(-1, 3)
    parts = [shape.signed_distance(flat[at : at + AT_ONCE], extents) for at in range(0, len(flat), AT_ONCE)]
    return np.concatenate([np.empty(0), *parts]).reshape(points.shape[:-1])
