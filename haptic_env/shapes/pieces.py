"""A solid as convex pieces, which is all that the physics can touch; found once and kept on disk."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import extras

Array = NDArray[np.float64]
# CoACD's own measure of concavity, and few enough iterations that a ring takes ten seconds; its pieces stick out by 1 %
HOW = {"threshold": 0.02, "mcts_iterations": 40, "preprocess_mode": "off", "seed": 0}
SAMPLES = 4000


def distance_from(vertices: Array, faces: NDArray[np.int64], points: Array) -> Array:
    """Signed distance (M,) of `points` (M, 3) from a closed surface, negative inside.

    By libigl's tree and pseudonormals (Bærentzen & Aanæs 2005, IEEE TVCG 11, 243-253): trimesh gives the same a
    hundred times slower.
    """
    igl = extras.load("igl", "meshes", "the distance from a mesh")
    corners, triangles = np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.int64)
    kind = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    return igl.signed_distance(np.ascontiguousarray(points), corners, triangles, sign_type=kind)[0]


def convex_pieces(solid: Any, tolerance: float) -> list[Array]:
    """The corners (M, 3) of the convex pieces of `solid`, a closed trimesh, in its frame and unit; one, its hull, if
    that sticks out by no more than `tolerance`."""
    hull = solid.convex_hull
    if _beyond(solid, hull) <= tolerance:
        return [np.asarray(hull.vertices)]
    return _remembered(np.asarray(solid.vertices), np.asarray(solid.faces))


def _beyond(solid: Any, hull: Any) -> float:
    """How far `hull` sticks out of `solid`."""
    places = hull.sample(SAMPLES, seed=0)
    return float(distance_from(solid.vertices, solid.faces, np.asarray(places)).max())


def _remembered(vertices: Array, faces: NDArray[np.int64]) -> list[Array]:
    """`_decompose`, kept in the user's cache folder: it takes seconds to minutes."""
    joblib, platformdirs = extras.load("joblib", "meshes", "a mesh"), extras.load("platformdirs", "meshes", "a mesh")
    memory = joblib.Memory(platformdirs.user_cache_dir("haptic_slam"), verbose=0)
    return memory.cache(_decompose)(vertices, faces)


def _decompose(vertices: Array, faces: NDArray[np.int64]) -> list[Array]:
    """CoACD (Wei et al. 2022, ACM Trans. Graph. 41, 42)."""
    coacd = extras.load("coacd", "meshes", "a concave mesh")
    coacd.set_log_level("error")
    pieces = coacd.run_coacd(coacd.Mesh(vertices, faces), **HOW)
    return [np.asarray(corners) for corners, _ in pieces]
