"""A solid of which all that is known was felt, as something that an object may be.

`ShapePosterior` holds touches against distances from a surface. Of this one it is told besides how surely it is known
at the vertex that is nearest: where it was not felt, neither a touch nor none shall decide
(`observer.shape.contact_likelihood`). Shapes: V vertices, F faces, M points. Metres.
"""

from __future__ import annotations

import hashlib
from functools import cached_property
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from haptic_env.hand import Hand
from haptic_env.shapes import triangles
from haptic_env.shapes.base import Shape, Solid
from haptic_env.shapes.pieces import distance_from
from haptic_env.shapes.proportions import check_kept
from observer.surface.mesh import Surface

KNOWN = 0.003  # m, SD of a surface up to which it counts as known


class FeltShape(Shape):
    """A surface that was felt, and how surely; its frame has its origin at the middle of its bounding box.

    Attributes:
        surface: in that frame.
    """

    exact = False

    def __init__(self, surface: Surface) -> None:
        """Take a surface.

        Args:
            surface: not empty, in any frame.

        Raises:
            ValueError: where it is empty, or of a size that nobody could hold.
            ImportError: where the extra `meshes` is missing.
        """
        triangles.check()
        if surface.empty:
            raise ValueError("the surface is empty, as nothing was touched: there is no object in it")
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        self.surface = surface._replace(vertices=surface.vertices - 0.5 * (low + high))
        x, y, z = super().check_size(high - low).tolist()
        self.default_size = (x, y, z)

    @cached_property
    def content(self) -> str:
        """A digest of the surface."""
        parts = b"".join(np.ascontiguousarray(each).tobytes() for each in self.surface)
        return f"felt {hashlib.sha256(parts).hexdigest()}"

    @cached_property
    def _vertices(self) -> cKDTree:
        return cKDTree(self.surface.vertices)

    def check_size(self, size: ArrayLike | None) -> NDArray[np.float64]:
        extents = super().check_size(size)
        check_kept("what was felt", extents, np.array(self.default_size))
        return extents

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        scale = size[0] / self.default_size[0]
        places = np.asarray(points, dtype=np.float64).reshape(-1, 3) / scale
        distance = distance_from(self.surface.vertices, self.surface.faces, places)
        return scale * distance.reshape(np.shape(points)[:-1])

    def spread(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64] | None:
        scale = size[0] / self.default_size[0]
        _, nearest = self._vertices.query(points / scale)
        return np.asarray(scale * self.surface.std[nearest])

    def geoms(self, root: Any, size: NDArray[np.float64]) -> NoReturn:
        raise ValueError(
            "what was felt is an object for observers alone; to explore it, save its surface and name that file"
        )

    def solid(self, name: str, hand: Hand) -> Solid:
        """Put it where a hand explores.

        Args:
            name: of the object.
            hand: that explores.

        Returns:
            The solid.
        """
        x, y, z = hand.place(np.array(self.default_size)).tolist()
        return Solid(f"{name}: {self.content}", self, self.default_size, (x, y, z))
