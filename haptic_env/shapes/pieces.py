"""A solid as convex pieces, which is all that the physics can touch; found once and kept on disk."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from haptic_env import cache, extras, notice
from haptic_env.arrays import Array
from haptic_env.shapes import decomposition
from haptic_env.shapes.decomposition import HOW

MANY = 20_000  # triangles: what is cut in a minute
FLAKE = 1e-8  # of the cube of a solid's width: less volume is not felt
SAMPLES = 4000
CUTTING = "Cutting a mesh into the convex pieces that physics can touch, once on this machine"
NEAR, ASTRAY = 0.015, 0.02  # of a solid's width: surfaces so near are one; of its bounding box: what may differ else


def distance_from(vertices: Array, faces: NDArray[np.int64], points: Array) -> Array:
    """Measure distances from a closed surface, by libigl's tree and pseudonormals.

    trimesh gives the same a hundred times slower.

    Args:
        vertices: (V, 3).
        faces: (F, 3).
        points: (M, 3).

    Returns:
        (M,), negative inside.

    Raises:
        ImportError: without the package `libigl`.

    References:
        Bærentzen & Aanæs 2005, IEEE TVCG 11, 243-253.
    """
    igl = extras.load("igl", "meshes", "the distance from a mesh")
    corners, triangles = np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.int64)
    kind = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    return igl.signed_distance(np.ascontiguousarray(points), corners, triangles, sign_type=kind)[0]


def inside_of(vertices: Array, faces: NDArray[np.int64], points: Array) -> NDArray[np.bool_]:
    """Tell around which points a closed surface winds: the sign of `distance_from`, unless the surface crosses itself.

    Args:
        vertices: (V, 3).
        faces: (F, 3).
        points: (M, 3).

    Returns:
        (M,).

    Raises:
        ImportError: without the package `libigl`.

    References:
        Barill et al. 2018, ACM Trans. Graph. 37, 43.
    """
    igl = extras.load("igl", "meshes", "the inside of a mesh")
    corners, triangles = np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.int64)
    return igl.fast_winding_number(corners, triangles, np.ascontiguousarray(points)) > 0.5


def convex_pieces(solid: Any, tolerance: float) -> list[Array]:
    """Cut a solid into convex pieces; one, its hull, if that sticks out by no more than `tolerance`.

    Args:
        solid: a closed trimesh.
        tolerance: in the unit of the solid.

    Returns:
        The corners (M, 3) of each piece, in the frame and unit of the solid.

    Raises:
        ValueError: where it cannot be cut.
    """
    if len(solid.faces) > MANY:
        solid = _simplified(solid, tolerance)
    hull = solid.convex_hull
    if _beyond(solid, hull) <= tolerance:
        return [np.asarray(hull.vertices)]
    return _remembered(solid)


def _astray(solid: Any, pieces: list[Array]) -> float:
    """In how much of the bounding box of `solid` either it or its `pieces` are, and not both, surfaces aside."""
    width, (low, high) = float(solid.extents.max()), solid.bounds
    near = NEAR * width
    around = np.random.default_rng(0).uniform(low - 2 * near, high + 2 * near, (SAMPLES, 3))
    outside = distance_from(solid.vertices, solid.faces, around)
    beyond = np.full(len(around), np.inf)
    for piece in felt(pieces, width):
        planes = ConvexHull(piece).equations
        beyond = np.minimum(beyond, (around @ planes[:, :3].T + planes[:, 3]).max(axis=1))
    return float((((outside < -near) & (beyond > 0)) | ((outside > near) & (beyond < 0))).mean())


def felt(pieces: list[Array], width: float) -> list[Array]:
    """Leave out mere flakes of a solid: the physics takes none without a volume.

    Args:
        pieces: corners (M, 3) of each.
        width: of the solid, in the same unit.

    Returns:
        The other pieces.
    """
    return [piece for piece in pieces if len(piece) > 3 and _volume(piece) > FLAKE * width**3]


def _volume(piece: Array) -> float:
    try:
        return float(ConvexHull(piece).volume)
    except QhullError:  # all in one plane
        return 0.0


def _simplified(solid: Any, tolerance: float) -> Any:
    """`solid` with fewer triangles, no corner further off than `tolerance`: cutting takes longer than they are many."""
    trimesh = extras.load("trimesh", "meshes", "a shape from a file")
    manifold = extras.load("manifold3d", "meshes", "a mesh of many triangles")
    corners, triangles = solid.vertices.astype(np.float64), solid.faces.astype(np.uint64)
    whole = manifold.Manifold(manifold.Mesh64(vert_properties=corners, tri_verts=triangles))
    for part in (8, 4, 2, 1):
        made = whole.simplify(tolerance / part).to_mesh64()
        if len(made.tri_verts) == 0:  # thinner than that
            break
        solid = trimesh.Trimesh(made.vert_properties, made.tri_verts.astype(np.int64), process=False)
        if len(solid.faces) <= MANY:
            break
    return solid


def _beyond(solid: Any, hull: Any) -> float:
    """How far `hull` sticks out of `solid`."""
    places = hull.sample(SAMPLES, seed=0)
    return float(distance_from(solid.vertices, solid.faces, np.asarray(places)).max())


def _remembered(solid: Any) -> list[Array]:
    """The pieces of a concave `solid`, kept in the user's cache folder: cutting takes seconds to minutes."""
    extras.folder("coacd", "meshes", "a concave mesh")
    vertices, faces = np.asarray(solid.vertices, np.float64), np.asarray(solid.faces, np.int64)
    told = f"{metadata.version('coacd')} {HOW} {vertices.shape} {faces.shape}".encode()
    name = hashlib.sha256(told + vertices.tobytes() + faces.tobytes()).hexdigest()
    with contextlib.suppress(Exception):  # not there, or no answer: it is found again
        return decomposition.unpack_pieces(_place(name).read_bytes())
    notice.tell(CUTTING, 0, 1)
    pieces = decomposition.cut(vertices, faces)
    notice.tell(CUTTING, 1, 1)
    wrong = _astray(solid, pieces)
    if wrong > ASTRAY:
        raise ValueError(
            f"cannot be cut into convex pieces: they differ from it in {wrong:.0%} of its bounding box; it may cross "
            "itself, repair it"
        )
    with contextlib.suppress(OSError):  # a full disk costs the time, no more
        _save(_place(name), pieces)
    return pieces


def _place(name: str) -> Path:
    return cache.folder() / "pieces" / f"{name}.npz"


def _save(place: Path, pieces: list[Array]) -> None:
    """Whole, or not at all."""
    place.parent.mkdir(exist_ok=True)
    handle, name = tempfile.mkstemp(dir=place.parent, suffix=".npz")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(decomposition.pack_pieces(pieces))
        os.replace(name, place)
    finally:
        Path(name).unlink(missing_ok=True)
