"""A regular voxel grid in metres.

Shapes: (X, Y, Z) voxels; points are (..., 3) metres in the grid's frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate


@dataclass(frozen=True)
class Grid:
    """Voxels of edge `resolution` (m) whose minimum corner is `origin` (3,) m.

    The centre of voxel (i, j, k) is origin + ((i, j, k) + 0.5) · resolution.
    """

    origin: tuple[float, float, float]
    resolution: float
    shape: tuple[int, int, int]

    @classmethod
    def around(cls, centre: ArrayLike, extent: ArrayLike, resolution: float) -> Grid:
        """The grid of whole voxels centred on `centre` (3,) that covers `extent` (3,) metres."""
        validate.number("grid resolution", resolution, above=0.0, unit="m")
        middle = validate.array("grid centre", centre, (3,), "m")
        wanted = validate.array("grid extent", extent, (3,), "m")
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
        """(X, Y, Z, 3) metres: centres of all voxels."""
        return np.asarray(self.origin) + (np.moveaxis(np.indices(self.shape), 0, -1) + 0.5) * self.resolution

    def index(self, points: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Voxel indices (..., 3) of `points` (..., 3) metres, and whether each lies in the grid (...)."""
        cells = np.floor((np.asarray(points) - np.asarray(self.origin)) / self.resolution).astype(np.int64)
        inside = ((cells >= 0) & (cells < np.asarray(self.shape))).all(axis=-1)
        return cells, inside
