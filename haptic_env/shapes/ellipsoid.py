"""A ball stretched along its axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.composer import mjcf
from haptic_env.shapes.proportions import extents_of
from haptic_env.shapes.star_shaped import StarShaped


class Ellipsoid(StarShaped):
    """All ellipsoids."""

    def __init__(self, x: float = 1.0, y: float = 1.0, z: float = 1.3) -> None:
        """Choose the proportions.

        Args:
            x: extent along x, in any unit.
            y: along y, in the same.
            z: along z, in the same.

        Raises:
            ValueError: where nobody could hold that.
        """
        self.default_size = extents_of("ellipsoid", x, y, z)

    def radius(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.ones(len(directions))

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        return [{"type": "ellipsoid", "size": size / 2}]
