"""What a shape is: a signed distance, MuJoCo geoms and a default size.

A shape's frame has its origin at the centre of its bounding box. `size` is its full extents (3,) in metres.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.composer import mjcf
from haptic_env.grid import Grid

SMALLEST, LARGEST = 0.005, 0.3  # metres: what a hand can feel at all
FAR = 1e6  # metres: where an object may lie, and points that are asked about
RGBA = (0.85, 0.65, 0.35, 1.0)


def rotation_matrix(quaternion: ArrayLike) -> NDArray[np.float64]:
    """(3, 3) rotation of a wxyz `quaternion` (4,) of any length above zero."""
    w, x, y, z = np.asarray(quaternion, dtype=np.float64) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Shape(ABC):
    """One family of solids, e.g. all boxes. Add one as a file and a line in `haptic_env.shapes.SHAPES`."""

    default_size: tuple[float, float, float] = (0.05, 0.05, 0.05)

    @abstractmethod
    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance (...,) m from `points` (..., 3) m, shape's frame, to the surface; negative inside."""

    @abstractmethod
    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        """Attributes of the convex MuJoCo geoms of this `size`; adds assets to `root` where it needs any."""

    def prepare(self) -> None:
        """Find now what `geoms` needs and takes long to find; raises `ValueError` where it cannot be found."""
        return

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        """Return the full extents (3,) m, the default for None; raise `ValueError` where they are not possible."""
        extents = validate.array("object size", self.default_size if size is None else size, (3,), "m")
        if (extents < SMALLEST).any() or (extents > LARGEST).any():
            raise ValueError(f"object size must lie in [{SMALLEST}, {LARGEST}] m, got {extents.tolist()}")
        return extents


@dataclass(frozen=True)
class Solid:
    """A shape of a given size at a given pose: everything that can be asked about a true object.

    `size` (3,) m full extents; `position` (3,) m and `quaternion` (4,) wxyz in the world frame.
    """

    name: str
    shape: Shape
    size: tuple[float, float, float]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Distance (...,) m from `points` (..., 3) m, world frame, to the surface; negative inside. Raises `ValueError`
        for points that are not finite or out of all reach."""
        places = validate.numbers("points", points, bound=FAR)
        if places.ndim == 0 or places.shape[-1] != 3:
            raise ValueError(f"points must be of shape (..., 3) in m, got shape {places.shape}")
        local = (places - self.position) @ rotation_matrix(self.quaternion)
        return self.shape.signed_distance(local, np.asarray(self.size))

    def occupancy(self, grid: Grid) -> NDArray[np.bool_]:
        """(X, Y, Z): whether the centre of each voxel of `grid` lies inside the object."""
        return self.signed_distance(grid.centres()) < 0
