"""How well a mesh fits the object that is there, in millimetres. Metrics may read the truth; observers never do.

Shapes: V vertices, F facets, M places. What is given is in metres, in the frame of the grid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.shapes import triangles
from haptic_env.shapes.base import Solid
from haptic_env.shapes.pieces import inside_of
from observer import edge
from observer.surface.mesh import Surface

MM = 1000.0
NEAR = 0.005  # m, of the F-score
FELT = 0.004  # m from a place that was touched: what is felt of a surface
BAND = 1.645  # SDs on each side: 90 %
FINE = 60  # facets of the true surface along its largest extent, about
STEP = 1e-5  # m, of differences


class MeshScore(NamedTuple):
    """A mesh against the true surface; NaN where there is nothing to measure.

    Distances are those to the nearest point of the other surface; means are by area, half from each side.

    Attributes:
        chamfer_felt_mm: of the part that was felt: from the places that were touched to the mesh, and from that part of
            the mesh to the true surface whose nearest point there is within `FELT` of such a place.
        chamfer_mm: of the whole.
        f_score: at 5 mm, of the whole: harmonic mean of the shares of each surface that are so near to the other.
        iou: volume that both have in common, as a share of that of both together.
        normal_consistency: mean cosine between normals at nearest points, of the whole, whichever way they point.
        band_felt: share of the places that were touched within the 90 % band of the mesh: no further from it than
            1.645 SD of its nearest point.
        band: the same of the whole true surface.
        std_felt_mm: mean SD of the mesh at the places that were touched.
        std_mm: mean SD of the whole mesh.
    """

    chamfer_felt_mm: float
    chamfer_mm: float
    f_score: float
    iou: float
    normal_consistency: float
    band_felt: float
    band: float
    std_felt_mm: float
    std_mm: float


class Facets(NamedTuple):
    """A surface in small pieces.

    Attributes:
        middle: (F, 3) m.
        normal: (F, 3).
        area: (F,) m².
    """

    middle: Array
    normal: Array
    area: Array


def mesh_score(surface: Surface, solid: Solid, touched: Array) -> MeshScore:
    """Hold a mesh against the surface that is there.

    Args:
        surface: to be judged.
        solid: that is there.
        touched: (M, 3) m, places that were really touched (`observer.surface_metrics.touched_places`).

    Returns:
        The figures, all NaN for an empty surface.

    Raises:
        ValueError: for what is none of these.
        ImportError: where the extra `meshes` is missing.
    """
    edge.world(solid=solid)
    validate.instance("surface", surface, Surface, "what belief.surface() returns")
    places = validate.numbers("touched", touched, 2, bound=validate.FARTHEST)
    if places.shape[1] != 3:
        raise ValueError(f"touched must be of shape (M, 3) in m, got shape {places.shape}")
    if surface.empty:
        return MeshScore(*[float("nan")] * len(MeshScore._fields))
    mesh, truth = facets(surface.vertices, surface.faces), true_facets(solid)
    there, deep, outward = mesh.middle, solid.signed_distance(mesh.middle), _gradient(solid, mesh.middle)
    back, felt = (triangles.nearest(surface.mesh, each) for each in (truth.middle, places))
    back_std, felt_std = ((each.share * surface.std[surface.faces[each.face]]).sum(axis=1) for each in (back, felt))
    foot = there - deep[:, None] * outward
    of_felt = cKDTree(places).query(foot)[0] <= FELT if len(places) else np.zeros(len(foot), dtype=bool)
    ours, theirs = mesh.area, truth.area
    near = _mean(np.abs(deep) <= NEAR, ours), _mean(back.distance <= NEAR, theirs)
    cosine = np.abs((mesh.normal * outward).sum(axis=1)), np.abs((truth.normal * mesh.normal[back.face]).sum(axis=1))
    std = surface.std[surface.faces].mean(axis=1)
    return MeshScore(
        chamfer_felt_mm=MM * 0.5 * (_mean(felt.distance) + _mean(np.abs(deep[of_felt]), ours[of_felt])),
        chamfer_mm=MM * 0.5 * (_mean(np.abs(deep), ours) + _mean(back.distance, theirs)),
        f_score=2 * near[0] * near[1] / sum(near) if sum(near) > 0 else 0.0,
        iou=_iou(surface, solid),
        normal_consistency=0.5 * (_mean(cosine[0], ours) + _mean(cosine[1], theirs)),
        band_felt=_mean(felt.distance <= BAND * felt_std),
        band=_mean(back.distance <= BAND * back_std, theirs),
        std_felt_mm=MM * _mean(felt_std),
        std_mm=MM * _mean(std, ours),
    )


def facets(vertices: Array, faces: NDArray[np.int64]) -> Facets:
    """Take a mesh apart.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3).

    Returns:
        Its facets.
    """
    a, b, c = (vertices[corner] for corner in faces.T)
    cross = np.cross(b - a, c - a)
    twice = np.linalg.norm(cross, axis=1)
    return Facets((a + b + c) / 3.0, cross / np.maximum(twice, 1e-30)[:, None], 0.5 * twice)


def true_mesh(solid: Solid) -> tuple[Array, NDArray[np.int64]]:
    """Draw the surface that is there.

    Args:
        solid: that is there.

    Returns:
        Vertices (V, 3) m, on its surface, and faces (F, 3).

    Raises:
        ImportError: where the extra `meshes` is missing.
    """
    reach = float(np.linalg.norm(solid.size))
    grid = Grid.around(solid.position, np.full(3, 1.1 * reach), reach / FINE)
    vertices, faces = triangles.marched(solid.signed_distance(grid.centres()), grid)
    return vertices - solid.signed_distance(vertices)[:, None] * _gradient(solid, vertices), faces


def true_facets(solid: Solid) -> Facets:
    """Take the true surface apart.

    Args:
        solid: that is there.

    Returns:
        Its facets.

    Raises:
        ImportError: where the extra `meshes` is missing.
    """
    return facets(*true_mesh(solid))


def _gradient(solid: Solid, places: Array) -> Array:
    """The way (M, 3) out of a solid."""
    steps = STEP * np.eye(3)
    slope = [solid.signed_distance(places + step) - solid.signed_distance(places - step) for step in steps]
    way = np.stack(slope, axis=1)
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-30)


def _iou(surface: Surface, solid: Solid) -> float:
    corners = np.concatenate([surface.vertices, solid.position + 0.5 * np.linalg.norm(solid.size) * _CORNERS])
    low, high = corners.min(axis=0), corners.max(axis=0)
    places = Grid.around(0.5 * (low + high), high - low, float((high - low).max()) / FINE).centres().reshape(-1, 3)
    mine, true = inside_of(*surface.mesh, places), solid.signed_distance(places) < 0
    return float((mine & true).sum() / (mine | true).sum())


_CORNERS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])


def _mean(values: Array | NDArray[np.bool_], weights: Array | None = None) -> float:
    """By weight; NaN of nothing."""
    return float(np.average(values, weights=weights)) if len(values) else float("nan")
