"""An L from bottom to top: two bars that share a corner."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.composer import mjcf
from haptic_env.shapes.extruded import Extruded
from haptic_env.shapes.proportions import extents_of


class Ell(Extruded):
    """All upright Ls, the corner at -x, -y: size is (along x, along y, height)."""

    def __init__(self, bar: float = 0.4, height: float = 0.6) -> None:
        """Choose the proportions.

        Args:
            bar: width of a bar over that of the whole, in [0.1, 0.9].
            height: over the width of the whole.

        Raises:
            ValueError: where a number is out of range, or nobody could hold that.
        """
        self.bar = validate.number("L's bar", bar, 0.1, 0.9)
        self.default_size = extents_of("L", 1.0, 1.0, height)

    def outline(self) -> NDArray[np.float64]:
        inner = self.bar - 0.5
        return np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, inner], [inner, inner], [inner, 0.5], [-0.5, 0.5]])

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        x, y, z = size / 2
        back = y * (1 - self.bar)  # the bars overlap at the corner, so that no seam can be felt
        side = x * (1 - self.bar)
        return [
            {"type": "box", "size": [x, y * self.bar, z], "pos": [0.0, -back, 0.0]},
            {"type": "box", "size": [x * self.bar, y, z], "pos": [-side, 0.0, 0.0]},
        ]
