"""A round cone cut off below its apex, the wider end at -z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.shapes.proportions import extents_of
from haptic_env.shapes.revolved import Revolved


class Frustum(Revolved):
    """All upright round frustums: size is (diameter, diameter, height), of the wider end."""

    def __init__(self, top: float = 0.5, height: float = 1.0) -> None:
        """Choose the proportions.

        Args:
            top: diameter of the upper end over that of the base, in [0.05, 1].
            height: over the diameter of the base.

        Raises:
            ValueError: where nobody could hold that, or the top is out of range.
        """
        self.top = validate.number("frustum's top", top, 0.05, 1.0)
        self.default_size = extents_of("frustum", 1.0, 1.0, height)

    def cross_section(self) -> NDArray[np.float64]:
        return np.array([[-0.5, -0.5], [0.5, -0.5], [0.5 * self.top, 0.5], [-0.5 * self.top, 0.5]])
