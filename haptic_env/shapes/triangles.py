"""What is asked of meshes of triangles, and answered by libraries: libigl and trimesh, of the extra `meshes`.

Shapes: V vertices, F faces, M places, (X, Y, Z) values on a lattice. Metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env import extras
from haptic_env.arrays import Array
from haptic_env.grid import Grid

EXTRA, WHAT = "meshes", "the mesh of a surface"


class Triangles(NamedTuple):
    """A mesh.

    Attributes:
        vertices: (V, 3) m.
        faces: (F, 3), counterclockwise from outside.
    """

    vertices: Array
    faces: NDArray[np.int64]


class NearestPoints(NamedTuple):
    """The points of a mesh that are nearest to M places.

    Attributes:
        distance: (M,) m.
        face: (M,) on which they lie.
        share: (M, 3) of the face's corners in them, which add up to one.
    """

    distance: Array
    face: NDArray[np.int64]
    share: Array


def check() -> None:
    """Check that the libraries are there.

    Raises:
        ImportError: where the extra is missing.
    """
    for name in ("igl", "trimesh"):
        extras.folder(name, EXTRA, WHAT)


def marched(value: Array, lattice: Grid) -> Triangles:
    """Draw where values are zero, by marching cubes (Lorensen & Cline 1987).

    Args:
        value: (X, Y, Z) at the lattice's centres, negative inside.
        lattice: of the values.

    Returns:
        The mesh, closed where nothing inside lies at the lattice's rim.

    Raises:
        ImportError: where the extra is missing.
    """
    igl = extras.load("igl", EXTRA, WHAT)
    places = np.ascontiguousarray(lattice.centres().transpose(2, 1, 0, 3).reshape(-1, 3))  # x runs fastest
    flat = np.ascontiguousarray(value.transpose(2, 1, 0).reshape(-1))
    vertices, faces, *_ = igl.marching_cubes(flat, places, *lattice.shape, 0.0)
    return Triangles(vertices, faces.astype(np.int64))


def largest_part(mesh: Triangles) -> Triangles | None:
    """Find the closed part of most volume.

    Args:
        mesh: of any parts.

    Returns:
        That part, or None where none is closed.

    Raises:
        ImportError: where the extra is missing.
    """
    trimesh = extras.load("trimesh", EXTRA, WHAT)
    parts = trimesh.Trimesh(*mesh, process=False).split(only_watertight=True)
    if not len(parts):
        return None
    largest = max(parts, key=lambda part: part.volume)
    return Triangles(np.asarray(largest.vertices), np.asarray(largest.faces, dtype=np.int64))


def nearest(mesh: Triangles, places: Array) -> NearestPoints:
    """Find the nearest points of a mesh.

    Args:
        mesh: of one face at least.
        places: (M, 3) m.

    Returns:
        The points.

    Raises:
        ImportError: where the extra is missing.
    """
    if not len(places):
        return NearestPoints(np.empty(0), np.empty(0, dtype=np.int64), np.empty((0, 3)))
    igl = extras.load("igl", EXTRA, WHAT)
    vertices, faces = (np.ascontiguousarray(each) for each in mesh)
    square, face, foot, *_ = igl.point_mesh_squared_distance(np.ascontiguousarray(places), vertices, faces)
    corners = (np.ascontiguousarray(vertices[corner]) for corner in faces[face].T)
    return NearestPoints(np.sqrt(square), face, igl.barycentric_coordinates(foot, *corners))


def encoded(mesh: Triangles, file_type: str, attributes: Mapping[str, Array], **options: object) -> bytes:
    """Write a mesh as the bytes of a file.

    Args:
        mesh: of any shape.
        file_type: that trimesh writes.
        attributes: (V,) of each vertex, by name; not all formats have room for them.
        **options: of trimesh's writer of that format.

    Returns:
        The bytes.

    Raises:
        ImportError: where the extra is missing.
    """
    trimesh = extras.load("trimesh", EXTRA, WHAT)
    made = trimesh.Trimesh(*mesh, process=False)
    for name, values in attributes.items():
        made.vertex_attributes[name] = values.astype(np.float32)
    content = made.export(file_type=file_type, **options)
    return content.encode() if isinstance(content, str) else bytes(content)
