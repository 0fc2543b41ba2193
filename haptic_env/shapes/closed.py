"""From a heap of triangles to closed solids, or to the reason why it is none. V corners, T triangles, E edges.

An edge is sound where one triangle runs along it in each direction. Bodies that touch share edges of four triangles or
more; they are told apart as long as as many run in one direction as in the other.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import extras
from haptic_env.shapes.pieces import distance_from, inside_of

FLAT = 1e-6  # of its bounding box: less volume is none
MOST = 500  # closed parts: more are the specks of a scan
SPECK = 0.01  # of the whole's width
SAMPLES, AGREE = 5000, 0.98  # points of the bounding box where two rules of what is inside are compared


def closed_parts(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> list[Any]:
    """The parts of a surface, each a closed trimesh that faces outwards.

    Raises `ValueError` where one has a hole, no inside or faces inwards, or where there are too many.
    """
    trimesh = extras.load("trimesh", "meshes", "a shape from a file")
    if len(triangles) == 0:
        raise ValueError("has no triangles: it is empty, or was cut short")
    surface = trimesh.Trimesh(vertices, triangles, process=False)
    surface.merge_vertices(merge_tex=True, merge_norm=True)
    surface.update_faces(_once(surface.faces))
    if len(surface.faces) == 0:
        raise ValueError(
            f"has no volume: it is flat, or each triangle is there from both sides, {_wide(vertices)} wide"
        )
    labels = trimesh.graph.connected_component_labels(surface.face_adjacency, node_count=len(surface.faces))
    sound = _check_edges(surface, labels)
    if labels.max() >= MOST:
        raise ValueError(_specks(surface, labels))
    parts = list(surface.split(only_watertight=False, repair=False))
    if not sound and not all(part.is_watertight for part in parts):
        parts = _taken_apart(trimesh, surface)
    for part in parts:
        box = float(np.prod(part.extents))
        if box == 0 or abs(part.volume) < FLAT * box:
            raise ValueError(f"has no volume: a part of it is flat, {part.extents.tolist()} wide")
        if not part.is_winding_consistent or part.volume < 0:
            raise ValueError("is turned inside out or hollow: the triangles of a part of it do not all face outwards")
    return parts


def union(parts: list[Any]) -> Any:
    """The surface of all `parts` together; raises `ValueError` where it crosses itself, so that no rule says what is
    inside."""
    trimesh = extras.load("trimesh", "meshes", "a shape from a file")
    surface = parts[0]
    if len(parts) > 1:
        surface = trimesh.boolean.union(parts)
        if len(surface.faces) == 0:
            raise ValueError("has parts that cannot be joined: they are too small for their distance")
    places = np.random.default_rng(0).uniform(surface.bounds[0], surface.bounds[1], (SAMPLES, 3))
    inside = distance_from(surface.vertices, surface.faces, places) < 0
    agree = float((inside == inside_of(surface.vertices, surface.faces, places)).mean())
    if agree < AGREE:
        raise ValueError(
            f"crosses or overlaps itself: of {1 - agree:.0%} of its bounding box nobody can say whether it is inside; "
            "repair it, e.g. by a union or a voxel remesh"
        )
    return surface


def _once(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Which of `faces` (T, 3) to keep: none whose corners coincide, one of those that are there twice, none of two that
    lie back to back, as where bodies touch."""
    low = np.sort(faces, axis=1)
    real = np.flatnonzero((low[:, 0] != low[:, 1]) & (low[:, 1] != low[:, 2]))
    start = np.argmin(faces, axis=1)[:, None]
    turned = np.take_along_axis(faces, (start + [0, 1, 2]) % 3, axis=1)  # the least corner first, as it is wound
    sign = np.where(turned[:, 1] < turned[:, 2], 1, -1)
    _, first, which = np.unique(low[real], axis=0, return_index=True, return_inverse=True)
    which = which.reshape(-1)
    total = np.zeros(len(first), dtype=np.int64)
    np.add.at(total, which, sign[real])
    if len(first) == len(faces):
        return np.arange(len(faces))
    wanted = np.sign(total)[which]
    kept = real[(wanted == sign[real]) & (wanted != 0)]
    of = which[(wanted == sign[real]) & (wanted != 0)]
    return np.sort(kept[np.unique(of, return_index=True)[1]])


def _check_edges(surface: Any, labels: NDArray[np.int64]) -> bool:
    """Whether each edge joins two triangles, and no more; raises `ValueError` where one triangle lacks another."""
    edges = surface.edges
    low = np.sort(edges, axis=1)
    _, which, count = np.unique(low[:, 0] * len(surface.vertices) + low[:, 1], return_inverse=True, return_counts=True)
    odd = count % 2 == 1
    if odd.any():
        parts = len(np.unique(labels[np.flatnonzero(odd[which]) // 3]))
        alone, several = int((count == 1).sum()), int((odd & (count > 1)).sum())
        told = [f"{alone} belong to one alone"] * bool(alone) + [f"{several} to three or more"] * bool(several)
        where = f", in {parts:,} of its {labels.max() + 1:,} separate parts" if labels.max() else ""
        advice = "close its holes" if alone else "remove the walls inside it"
        raise ValueError(
            f"is not watertight: {int(odd.sum())} edges do not join two triangles ({', '.join(told)}){where}; {advice}"
        )
    forward = np.bincount(which, weights=np.where(edges[:, 0] < edges[:, 1], 1, -1))
    if (forward != 0).any():
        raise ValueError(
            "is turned inside out or hollow: the triangles of a part of it do not all face outwards; at "
            f"{int((forward != 0).sum())} edges two neighbours face opposite ways"
        )
    return bool((count == 2).all())


def _specks(surface: Any, labels: NDArray[np.int64]) -> str:
    corners = surface.triangles
    low, high = np.full((labels.max() + 1, 3), np.inf), np.full((labels.max() + 1, 3), -np.inf)
    np.minimum.at(low, labels, corners.min(axis=1))
    np.maximum.at(high, labels, corners.max(axis=1))
    small = int(((high - low).max(axis=1) < SPECK * surface.extents.max()).sum())
    return (
        f"has {len(low):,} separate parts, at most {MOST} are taken; {small:,} of them are smaller than "
        f"{SPECK:.0%} of it: remove the specks of the scan, keep its largest part"
    )


def _taken_apart(trimesh: Any, surface: Any) -> list[Any]:
    """The parts of a surface with edges where four triangles or more meet, each with edges of two."""
    manifold = extras.load("manifold3d", "meshes", "bodies that touch")
    corners, faces = surface.vertices.astype(np.float64), surface.faces.astype(np.uint64)
    whole = manifold.Manifold(manifold.Mesh64(vert_properties=corners, tri_verts=faces))
    if whole.status() != manifold.Error.NoError:
        raise ValueError("touches itself along edges where more than two triangles meet: separate what touches there")
    meshes = [part.to_mesh64() for part in whole.decompose()]
    made = [trimesh.Trimesh(each.vert_properties, each.tri_verts.astype(np.int64), process=False) for each in meshes]
    parts = [part for part in made if abs(part.volume) > FLAT * np.prod(part.extents)]
    if not parts:
        raise ValueError(f"has no volume: it is flat, {_wide(surface.vertices)} wide")
    return parts


def _wide(vertices: NDArray[np.float64]) -> list[float]:
    return np.ptp(vertices, axis=0).round(9).tolist()
