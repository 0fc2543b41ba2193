"""A closed mesh of the surface, and how surely each vertex is known.

Shapes: V vertices, F faces. Metres, in the frame of the grid.
"""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env import readable
from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.shapes import triangles
from observer.surface import files
from observer.surface.gaussian_process import Field, Sphere
from observer.surface.reconstruction import reconstruct
from observer.surface.touches import TouchLog

SPACING = 0.003  # m, of the lattice from which the mesh is drawn
BEYOND = 0.03  # m, of the lattice about all that was touched
FLATTEST = 0.3  # least slope of the function across its surface that is believed


class Surface(NamedTuple):
    """A closed mesh, or nothing where nothing was touched.

    Attributes:
        vertices: (V, 3) m.
        faces: (F, 3), indices of vertices, counterclockwise from outside.
        std: (V,) m, SD of the place of each vertex, across the surface.
    """

    vertices: Array
    faces: NDArray[np.int64]
    std: Array

    def __repr__(self) -> str:
        return readable.line(self)

    @property
    def empty(self) -> bool:
        """Whether nothing was touched."""
        return len(self.vertices) == 0

    @property
    def mesh(self) -> triangles.Triangles:
        """The mesh alone."""
        return triangles.Triangles(self.vertices, self.faces)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it to a file, whole or not at all.

        Args:
            path: of the file, whose name says the format: .ply (with a property `std` of each vertex, m), .stl, .obj,
                .glb, or .xyz, a point cloud with a line "x y z std" for each vertex.

        Raises:
            ValueError: for another format, where it cannot be written, and for an empty surface.
            ImportError: where the extra `meshes` is missing.
        """
        files.save(self, path)


EMPTY = Surface(np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), np.empty(0))


def surface_of(touches: TouchLog, occupancy: Array, grid: Grid) -> Surface:
    """Draw the surface of what was touched.

    Args:
        touches: of the trial so far.
        occupancy: (X, Y, Z) probabilities; what they say was swept lies outside.
        grid: of those.

    Returns:
        The surface, empty where nothing was touched.

    Raises:
        ImportError: where the extra `meshes` is missing.
    """
    triangles.check()
    if not len(touches):
        return EMPTY
    skin = touches.skin()
    return drawn(*reconstruct(skin, occupancy, grid))


def drawn(field: Field, sphere: Sphere, spacing: float = SPACING) -> Surface:
    """Draw where a function is zero.

    Args:
        field: that is negative inside.
        sphere: near which it is.
        spacing: m, of the lattice on which it is computed.

    Returns:
        The largest closed part of its surface.
    """
    low, high = field.reach
    low, high = (np.minimum(low, sphere.centre - sphere.radius), np.maximum(high, sphere.centre + sphere.radius))
    size = high - low + 2.0 * BEYOND
    lattice = Grid.around(0.5 * (low + high), size, max(spacing, float(size.max()) / 200.0))
    value = field.value(lattice.centres().reshape(-1, 3)).reshape(lattice.shape)
    for axis in range(3):  # nothing reaches the rim, where it would be left open
        rim = np.moveaxis(value, axis, 0)
        rim[[0, -1]] = np.maximum(rim[[0, -1]], 0.5 * lattice.resolution)
    found = triangles.largest_part(triangles.marched(value, lattice))
    if found is None:
        return EMPTY
    vertices, faces = found
    slope = np.linalg.norm(field.gradient(vertices), axis=1)
    std = field.std(vertices) / np.maximum(slope, FLATTEST)
    return Surface(vertices, faces, std)
