"""Where one frame lies in another."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env.shapes.base import rotation_matrix

Array = NDArray[np.float64]


class Pose(NamedTuple):
    """A point x (3,) of the inner frame lies at `position` (3,) m + `rotation` (3, 3) · x of the outer one."""

    position: Array
    rotation: Array

    @classmethod
    def of(cls, position: ArrayLike, quaternion: ArrayLike) -> Self:
        """From a `position` (3,) m and a `quaternion` (4,) wxyz."""
        return cls(np.array(position, dtype=np.float64), rotation_matrix(quaternion))

    def __matmul__(self, inner: Pose) -> Pose:
        """Of a frame at `inner` in this one: where it lies in this one's outer frame."""
        return Pose(self.position + self.rotation @ inner.position, self.rotation @ inner.rotation)

    def inverse(self) -> Pose:
        """Of the outer frame in the inner one."""
        return Pose(-self.rotation.T @ self.position, self.rotation.T.copy())
