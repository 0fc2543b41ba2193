"""A round cone standing along z, apex at +z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.shapes.proportions import extents_of
from haptic_env.shapes.revolved import Revolved


class Cone(Revolved):
    """All upright round cones: size is (diameter, diameter, height)."""

    def __init__(self, height: float = 1.0) -> None:
        """Choose the proportions.

        Args:
            height: over the diameter of the base.

        Raises:
            ValueError: where nobody could hold that.
        """
        self.default_size = extents_of("cone", 1.0, 1.0, height)

    def cross_section(self) -> NDArray[np.float64]:
        return np.array([[-0.5, -0.5], [0.5, -0.5], [0.0, 0.5]])
