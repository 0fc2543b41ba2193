"""A cylinder with round ends, along z."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.composer import mjcf
from haptic_env.shapes.base import Shape
from haptic_env.shapes.proportions import extents_of


class Capsule(Shape):
    """All upright capsules: size is (diameter, diameter, length), at least as long as wide."""

    def __init__(self, length: float = 2.0) -> None:
        """Choose the proportions.

        Args:
            length: of the whole over its diameter, at least 1.

        Raises:
            ValueError: where it is shorter, or nobody could hold that.
        """
        self.default_size = extents_of("capsule", 1.0, 1.0, validate.number("capsule's length", length, 1.0))

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        extents = super().check_size(size)
        if not np.isclose(extents[0], extents[1]) or extents[2] < extents[0] * (1 - 1e-6):
            raise ValueError(
                "a capsule's size is (diameter, diameter, length) in metres, the length no less than the diameter, "
                f"got {extents.tolist()}"
            )
        return extents

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        straight = np.maximum(size[2] - size[0], 0.0) / 2
        beyond = np.maximum(np.abs(points[..., 2]) - straight, 0.0)
        return np.hypot(np.hypot(points[..., 0], points[..., 1]), beyond) - size[0] / 2

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        straight = max(size[2] - size[0], 1e-6) / 2  # MuJoCo takes none without any
        return [{"type": "capsule", "size": [size[0] / 2, straight]}]
