"""Where one frame lies in another."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
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

    def checked(self, what: str) -> Pose:
        """A copy; raises `ValueError` that names `what` for other shapes, or a rotation that is none."""
        position = validate.array(f"position of {what}", self.position, (3,), "m").copy()
        rotation = validate.array(f"rotation of {what}", self.rotation, (3, 3)).copy()
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(rotation) < 0:
            raise ValueError(f"rotation of {what} must be a rotation matrix, got {rotation.tolist()}")
        return Pose(position, rotation)
