"""A box standing along its axes; a cube by default."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.composer import mjcf
from haptic_env.shapes.base import Shape


class Cube(Shape):
    """All boxes."""

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        beyond = np.abs(points) - size / 2
        return np.linalg.norm(np.maximum(beyond, 0.0), axis=-1) + np.minimum(beyond.max(axis=-1), 0.0)

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        return [{"type": "box", "size": size / 2}]
