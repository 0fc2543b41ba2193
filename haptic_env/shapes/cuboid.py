"""A box of any proportions."""

from __future__ import annotations

from haptic_env.shapes.cube import Cube
from haptic_env.shapes.proportions import extents_of


class Cuboid(Cube):
    """All boxes, by the proportions of their sides."""

    def __init__(self, x: float = 1.0, y: float = 1.0, z: float = 1.5) -> None:
        """Choose the proportions.

        Args:
            x: extent along x, in any unit.
            y: along y, in the same.
            z: along z, in the same.

        Raises:
            ValueError: where nobody could hold that.
        """
        self.default_size = extents_of("cuboid", x, y, z)
