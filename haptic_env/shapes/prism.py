"""A regular polygon from bottom to top."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.composer import mjcf
from haptic_env.shapes.extruded import Extruded
from haptic_env.shapes.proportions import extents_of

FEWEST, MOST = 3, 12  # sides


class Prism(Extruded):
    """All upright prisms on a polygon: size is (along x, along y, height)."""

    def __init__(self, sides: int = 6, height: float = 1.0) -> None:
        """Choose the polygon and the proportions.

        Args:
            sides: of the polygon, 3 to 12; it is regular at the default size.
            height: over the width along x.

        Raises:
            ValueError: where a number is out of range, or nobody could hold that.
        """
        self.sides = validate.integer("prism's sides", sides, FEWEST, MOST)
        turn = np.pi / 2 + 2 * np.pi * np.arange(self.sides) / self.sides
        corners = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        low, high = corners.min(axis=0), corners.max(axis=0)
        self._outline = (corners - (low + high) / 2) / (high - low)
        wide, deep = high - low
        self.default_size = extents_of("prism", float(wide), float(deep), height * float(wide))

    def outline(self) -> NDArray[np.float64]:
        return self._outline

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        flat = self._outline * size[:2]
        ends = [np.column_stack([flat, np.full(self.sides, up)]) for up in (-size[2] / 2, size[2] / 2)]
        return [{"type": "mesh", "mesh": root.asset.add("mesh", name="prism", vertex=np.ravel(ends))}]
