"""A regular voxel grid in metres.

Shapes: (X, Y, Z) voxels; points are (..., 3) metres in the grid's frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate

SMALLEST, LARGEST = 1e-5, 1.0  # metres: edge of a voxel
VOXELS = 2**24  # at most: those of a map of that many take a third of a gigabyte


@dataclass(frozen=True)
class Grid:
    """Voxels of edge `resolution` (m) whose minimum corner is `origin` (3,) m.

    The centre of voxel (i, j, k) is origin + ((i, j, k) + 0.5) · resolution.

    Attributes:
        origin: (3,) m, none beyond ± `validate.FARTHEST`.
        resolution: m, in [`SMALLEST`, `LARGEST`].
        shape: (X, Y, Z), how many voxels along each axis: 1 at least, and together `VOXELS` at most.

    Raises:
        ValueError: for values that are none of those.
    """

    origin: tuple[float, float, float]
    resolution: float
    shape: tuple[int, int, int]

    def __post_init__(self) -> None:
        origin = validate.place("grid origin", self.origin)
        resolution = validate.number("grid resolution", self.resolution, SMALLEST, LARGEST, unit="m")
        try:
            x, y, z = self.shape
        except (TypeError, ValueError) as error:
            raise ValueError(f"grid shape must be three counts, got {validate.shown(self.shape)}") from error
        x, y, z = (validate.integer("grid shape", count, 1) for count in (x, y, z))
        if x * y * z > VOXELS:
            raise ValueError(
                f"a grid of {x} × {y} × {z} voxels of {resolution:g} m is too large for the memory, {VOXELS} are "
                "possible; choose larger voxels or a smaller extent"
            )
        # Plain numbers, whatever was given: grids are compared and hashed, and their arrays typed by kernels.
        for name, value in (("origin", tuple(origin.tolist())), ("resolution", resolution), ("shape", (x, y, z))):
            object.__setattr__(self, name, value)

    @classmethod
    def around(cls, centre: ArrayLike, extent: ArrayLike, resolution: float) -> Grid:
        """Make the grid of whole voxels that covers a box.

        Args:
            centre: (3,) m, of the box and of the grid.
            extent: (3,) m, edge lengths of the box.
            resolution: m.

        Returns:
            The grid: along each axis the extent in voxels, rounded, and 1 at least.

        Raises:
            ValueError: for what no grid can be made of; see `Grid`.
        """
        validate.number("grid resolution", resolution, SMALLEST, LARGEST, unit="m")
        middle = validate.place("grid centre", centre)
        wanted = validate.array("grid extent", extent, (3,), "m", bound=2 * validate.FARTHEST)
        if (wanted <= 0).any():
            raise ValueError(f"grid extent must be positive in metres, got {wanted.tolist()}")
        counts = np.maximum(1, np.round(wanted / resolution)).astype(int)
        origin = middle - 0.5 * counts * resolution
        x, y, z = (int(n) for n in counts)
        return cls(tuple(origin.tolist()), float(resolution), (x, y, z))

    @property
    def centre(self) -> NDArray[np.float64]:
        """(3,) metres: the middle of the grid."""
        return np.asarray(self.origin) + 0.5 * np.asarray(self.shape) * self.resolution

    @property
    def extent(self) -> NDArray[np.float64]:
        """(3,) metres: edge lengths of the whole grid."""
        return np.asarray(self.shape) * self.resolution

    def centres(self) -> NDArray[np.float64]:
        """Give the centres of all voxels.

        Returns:
            (X, Y, Z, 3) m.
        """
        return np.asarray(self.origin) + (np.moveaxis(np.indices(self.shape), 0, -1) + 0.5) * self.resolution

    def index(self, points: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Find the voxels that hold `points`.

        Args:
            points: (..., 3) m.

        Returns:
            Voxel indices (..., 3), those of points beyond ± `2 FARTHEST` m at most, and whether each point lies in the
            grid (...).

        Raises:
            ValueError: for points that are not finite.
        """
        where = validate.numbers("points", points)
        if where.ndim == 0 or where.shape[-1] != 3:
            raise ValueError(f"points must be of shape (..., 3) in m, got shape {where.shape}")
        where = where.clip(-2 * validate.FARTHEST, 2 * validate.FARTHEST)  # whose indices are integers still
        cells = np.floor((where - np.asarray(self.origin)) / self.resolution).astype(np.int64)
        inside = ((cells >= 0) & (cells < np.asarray(self.shape))).all(axis=-1)
        return cells, inside
