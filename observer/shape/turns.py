"""The turns that an object may have: uniform among those by no more than an angle. Quaternions are xyzw."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from haptic_env import rotation
from haptic_env.arrays import Array

ROUNDED = 1e-9  # rad, by which a turn may be too far


def angle(cosine: Array) -> Array:
    """Tell how far turns are.

    Args:
        cosine: (...) of the half angles, the real parts of quaternions or the products of two.

    Returns:
        (...) rad, in [0, pi].
    """
    return np.asarray(2.0 * np.arccos(np.minimum(np.abs(cosine), 1.0)))


def product(second: Array, first: Array) -> Array:
    """Turn by one turn and then by another.

    Args:
        second: (..., 4).
        first: (..., 4).

    Returns:
        (..., 4).
    """
    a, b, c, d = np.moveaxis(second, -1, 0)
    x, y, z, w = np.moveaxis(first, -1, 0)
    return np.stack(
        [
            d * x + a * w + b * z - c * y,
            d * y - a * z + b * w + c * x,
            d * z + a * y - b * x + c * w,
            d * w - a * x - b * y - c * z,
        ],
        axis=-1,
    )


class Turns:
    """Turns by no more than an angle.

    Attributes:
        most: rad; 0: an object is not turned.
    """

    def __init__(self, degrees: float) -> None:
        """Take the angle.

        Args:
            degrees: in [0, 180].
        """
        self.most = float(np.deg2rad(degrees))

    @property
    def share(self) -> float:
        """Of all turns, how many these are."""
        return float((self.most - np.sin(self.most)) / np.pi)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Draw turns.

        Args:
            count: M.
            rng: draws.

        Returns:
            (M, 4).
        """
        return np.asarray(rotation.drawn(rng, self.most, count).as_quat())

    def allowed(self, turns: Array) -> NDArray[np.bool_]:
        """Tell which turns are among these.

        Args:
            turns: (M, 4).

        Returns:
            (M,).
        """
        return np.asarray(angle(turns[:, 3]) <= self.most + ROUNDED)

    def propose(self, turns: Array, step: Array, anew: NDArray[np.bool_], rng: np.random.Generator) -> Array:
        """Propose other turns, as probably from one to the other as back.

        Args:
            turns: (M, 4).
            step: (M, 1) rad, SD of a small turn about each axis.
            anew: (M,) which to draw anew instead.
            rng: draws.

        Returns:
            (M, 4); one that would be turned too far stays.
        """
        fresh = self.draw(len(turns), rng)
        near = (Rotation.from_rotvec(step * rng.standard_normal((len(turns), 3))) * Rotation.from_quat(turns)).as_quat()
        proposed = np.where(self.allowed(near)[:, None], near, turns)
        return np.where(anew[:, None], fresh, proposed)
