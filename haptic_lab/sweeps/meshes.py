"""How much of an object's whole surface a trial reached, and how well the mesh of a belief fits: the measures of
`--meshes`.

Shapes: M touched places, S places of the whole surface.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from haptic_env.shapes.base import Solid
from haptic_lab.records import BeliefTrace
from haptic_lab.sweeps.measures import GroundTruth
from observer.surface.metrics import MeshScore, mesh_score

TOUCHED = "touched_coverage"
OF_MESH = tuple(f"mesh_{name}" for name in MeshScore._fields)
MESHES = (TOUCHED, *OF_MESH)
TITLES = {
    "surface_coverage": "Share of the whole surface that is mapped",
    TOUCHED: "Share of the whole surface that the skin was at, within a voxel",
    "surface_precision_1": "Share of the occupied voxels that are at the surface",
    "mesh_iou": "Intersection over union of the mesh and the object",
    "mesh_chamfer_mm": "Chamfer distance of mesh and object, of the whole (mm)",
    "mesh_f_score": "F-score of the mesh at 5 mm",
}


def measures_of_mesh(trace: BeliefTrace, solid: Solid, truth: GroundTruth) -> dict[str, float]:
    """Judge the surface that an observer believes in at the end.

    Args:
        trace: what it believed.
        solid: that was explored.
        truth: of the exploration.

    Returns:
        A value for each of `MESHES`; NaN where there is nothing to measure, as of observers without a map.
    """
    fit = dict.fromkeys(OF_MESH, float("nan"))
    if trace.belief.snapshot.touches is not None:
        score = mesh_score(trace.belief.surface(), solid, truth.touched)
        fit = dict(zip(OF_MESH, score, strict=True))
    return {TOUCHED: touched_coverage(truth, trace.belief.grid.resolution), **fit}


def touched_coverage(truth: GroundTruth, resolution: float) -> float:
    """Tell how much of the whole surface the skin was at.

    Args:
        truth: of an exploration.
        resolution: m, edge of a voxel.

    Returns:
        Share of the voxels that the surface passes through within a voxel of a place that was really touched; NaN of
        nothing.
    """
    if not len(truth.surface):
        return float("nan")
    if not len(truth.touched):
        return 0.0
    distance, _ = cKDTree(truth.touched).query(truth.surface)
    return float(np.mean(distance <= resolution))
