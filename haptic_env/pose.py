"""Where one frame lies in another."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.shapes.base import rotation_matrix

EXACT = 1e-5  # of a rotation matrix: how far its rows may be from unit length and right angles


class _Frame(NamedTuple):
    position: Array
    rotation: Array


class Pose(_Frame):
    """A point x (3,) of the inner frame lies at `position` (3,) m + `rotation` (3, 3) · x of the outer one.

    Attributes:
        position: (3,) m, the inner frame's origin.
        rotation: (3, 3), of the inner frame's axes.

    Raises:
        ValueError: for a position that is not finite or beyond ± `validate.FARTHEST` m, and no rotation matrix.
    """

    __slots__ = ()

    def __new__(cls, position: ArrayLike, rotation: ArrayLike) -> Self:
        return super().__new__(cls, *_checked("a pose", position, rotation))

    @classmethod
    def of(cls, position: ArrayLike, quaternion: ArrayLike) -> Self:
        """Make a pose of a position and a quaternion.

        Args:
            position: (3,) m.
            quaternion: (4,) wxyz, of any length but zero.

        Returns:
            The pose.

        Raises:
            ValueError: for numbers that are none of these.
        """
        place = validate.place("position of a pose", position).copy()
        return cls(place, rotation_matrix(validate.quaternion("quaternion of a pose", quaternion)))

    def __matmul__(self, inner: Pose) -> Pose:
        """Of a frame at `inner` in this one: where it lies in this one's outer frame."""
        return Pose(self.position + self.rotation @ inner.position, self.rotation @ inner.rotation)

    def inverse(self) -> Pose:
        """Give the pose of the outer frame in the inner one.

        Returns:
            The pose.
        """
        return Pose(-self.rotation.T @ self.position, self.rotation.T.copy())

    def checked(self, what: str) -> Pose:
        """Copy the pose.

        Args:
            what: its name, for the error.

        Returns:
            The copy.

        Raises:
            ValueError: where the arrays have been changed into no pose.
        """
        position, rotation = _checked(what, self.position, self.rotation)
        return Pose(position.copy(), rotation.copy())


def _checked(what: str, position: ArrayLike, rotation: ArrayLike) -> tuple[Array, Array]:
    place = validate.place(f"position of {what}", position)
    axes = validate.array(f"rotation of {what}", rotation, (3, 3), bound=2.0)
    if np.abs(axes @ axes.T - np.eye(3)).max() > EXACT or np.linalg.det(axes) < 0:
        raise ValueError(f"rotation of {what} must be a rotation matrix, got {axes.tolist()}")
    return place, axes
