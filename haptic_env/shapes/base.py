"""What a shape is: a signed distance, MuJoCo geoms and a default size.

A shape's frame has its origin at the centre of its bounding box. `size` is its full extents (3,) in metres.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import readable, validate
from haptic_env.composer import mjcf
from haptic_env.grid import Grid

SMALLEST, LARGEST = 0.005, 0.3  # metres: what a hand can feel at all
FAR = 1e6  # metres: where an object may lie, and points that are asked about
RGBA = (0.85, 0.65, 0.35, 1.0)


def rotation_matrix(quaternion: ArrayLike) -> NDArray[np.float64]:
    """Make the rotation matrix of a quaternion.

    Args:
        quaternion: (4,) wxyz, of any length above zero.

    Returns:
        (3, 3).
    """
    w, x, y, z = np.asarray(quaternion, dtype=np.float64) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Shape(ABC):
    """One family of solids, e.g. all boxes. Add one as a file and a line in `haptic_env.shapes.SHAPES`.

    Attributes:
        default_size: m, full extents.
        exact: whether its distances are those from a surface everywhere, so that a ball of flesh whose middle is nearer
            than its radius would lie in it; not where the surface is known in part.
    """

    default_size: tuple[float, float, float] = (0.05, 0.05, 0.05)
    exact = True

    def __repr__(self) -> str:
        return f"<{type(self).__name__}, usually {readable.millimetres(self.default_size)}>"

    @property
    def content(self) -> str:
        """A digest of what the shape is, for one whose distances take long and are kept on disk; "": they do not."""
        return ""

    @abstractmethod
    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        """Measure distances to the surface.

        Args:
            points: (..., 3) m, in the shape's frame.
            size: (3,) m, full extents.

        Returns:
            (...,) m, negative inside.
        """

    def spread(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Tell how surely the surface is known, of a shape that is not `exact`; others are not asked.

        Args:
            points: (M, 3) m, in the shape's frame.
            size: (3,) m, full extents.

        Returns:
            (M,) m, SD of the place of the surface near each; None: it is known.
        """
        return None

    @abstractmethod
    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        """Describe the solid to MuJoCo.

        Args:
            root: of the MJCF tree; assets are added where it needs any.
            size: (3,) m, full extents.

        Returns:
            The attributes of each of its convex geoms.
        """

    def prepare(self) -> None:
        """Find now what `geoms` needs and takes long to find.

        Raises:
            ValueError: where it cannot be found.
        """
        return

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        """Check that a size is possible.

        Args:
            size: (3,) m, full extents; None: the default.

        Returns:
            (3,) m.

        Raises:
            ValueError: where it is not.
        """
        extents = validate.array("object size", self.default_size if size is None else size, (3,), "m")
        if (extents < SMALLEST).any() or (extents > LARGEST).any():
            raise ValueError(f"object size must lie in [{SMALLEST}, {LARGEST}] m, got {extents.tolist()}")
        return extents


@dataclass(frozen=True)
class Solid:
    """A shape of a given size at a given pose: everything that can be asked about a true object.

    Attributes:
        name: of the shape, or the path of the mesh.
        shape: the family that it is of.
        size: (3,) m, full extents.
        position: (3,) m, in the world.
        quaternion: (4,) wxyz, in the world.
    """

    name: str
    shape: Shape
    size: tuple[float, float, float]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def __repr__(self) -> str:
        place = ", ".join(f"{1e3 * each:.3g}" for each in self.position)
        turned = "" if self.quaternion[0] == 1.0 else f", turned by {readable.VALUES.repr(self.quaternion)}"
        return f"<Solid {self.name}: {readable.millimetres(self.size)} at ({place}) mm{turned}>"

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Measure distances to the surface.

        Args:
            points: (..., 3) m, in the world.

        Returns:
            (...,) m, negative inside.

        Raises:
            ValueError: for points that are not finite or out of all reach.
        """
        places = validate.numbers("points", points, bound=FAR)
        if places.ndim == 0 or places.shape[-1] != 3:
            raise ValueError(f"points must be of shape (..., 3) in m, got shape {places.shape}")
        local = (places - self.position) @ rotation_matrix(self.quaternion)
        return self.shape.signed_distance(local, np.asarray(self.size))

    def occupancy(self, grid: Grid) -> NDArray[np.bool_]:
        """Find the voxels whose centre lies inside the object.

        Args:
            grid: in the world.

        Returns:
            (X, Y, Z).
        """
        return self.signed_distance(grid.centres()) < 0
