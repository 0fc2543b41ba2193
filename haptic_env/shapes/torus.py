"""A ring about z with a round tube."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.composer import mjcf
from haptic_env.shapes.base import Shape
from haptic_env.shapes.proportions import extents_of

SECTORS, AROUND = 32, 24  # convex pieces of the ring, and corners of its tube, as the physics has them


class Torus(Shape):
    """All lying tori: size is (diameter, diameter, diameter of the tube)."""

    def __init__(self, tube: float = 0.3) -> None:
        """Choose the proportions.

        Args:
            tube: its diameter over that of the whole, in [0.1, 0.49].

        Raises:
            ValueError: where it is out of range.
        """
        self.default_size = extents_of("torus", 1.0, 1.0, validate.number("torus's tube", tube, 0.1, 0.49))

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        extents = super().check_size(size)
        if not np.isclose(extents[0], extents[1]) or extents[2] >= extents[0] / 2:
            raise ValueError(
                "a torus's size is (diameter, diameter, diameter of the tube) in metres, the tube below half the "
                f"diameter, got {extents.tolist()}"
            )
        return extents

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        ring = (size[0] - size[2]) / 2
        return np.hypot(np.hypot(points[..., 0], points[..., 1]) - ring, points[..., 2]) - size[2] / 2

    def geoms(self, root: mjcf.RootElement, size: NDArray[np.float64]) -> list[dict[str, Any]]:
        ring, tube = (size[0] - size[2]) / 2, size[2] / 2
        around = np.linspace(0.0, 2 * np.pi, AROUND, endpoint=False)
        turn = np.linspace(0.0, 2 * np.pi, SECTORS, endpoint=False)[:, None]
        out, up = ring + tube * np.cos(around), np.broadcast_to(tube * np.sin(around), (SECTORS, AROUND))
        circles = np.stack([out * np.cos(turn), out * np.sin(turn), up], axis=-1)
        pieces = np.concatenate([circles, np.roll(circles, -1, axis=0)], axis=1)
        return [
            {"type": "mesh", "mesh": root.asset.add("mesh", name=f"sector{number}", vertex=np.ravel(piece))}
            for number, piece in enumerate(pieces)
        ]
