"""Between box, ball, cylinder and octahedron: two exponents say how round."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.shapes.proportions import USUAL
from haptic_env.shapes.star_shaped import StarShaped

LEAST, MOST = 0.2, 1.8  # beyond either, edges are too sharp for the triangles of the surface


class Superquadric(StarShaped):
    """All superellipsoids.

    References:
        Barr 1981, IEEE Computer Graphics and Applications 1(1), 11-23.
    """

    def __init__(self, upright: float = 0.5, around: float = 0.5) -> None:
        """Choose the exponents: towards 0 square, 1 round, 2 flat from edge to edge.

        Args:
            upright: of the outline seen from the side, in [0.2, 1.8].
            around: of the outline seen from above, in [0.2, 1.8].

        Raises:
            ValueError: where one is out of range.
        """
        self.upright = validate.number("superquadric's exponent upright", upright, LEAST, MOST)
        self.around = validate.number("superquadric's exponent around", around, LEAST, MOST)
        self.default_size = (USUAL, USUAL, USUAL)

    def radius(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y, z = np.abs(directions).T
        flat = (x ** (2 / self.around) + y ** (2 / self.around)) ** (self.around / self.upright)
        return (flat + z ** (2 / self.upright)) ** (-self.upright / 2)
