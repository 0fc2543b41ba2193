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
from haptic_env.shapes.touching import Edges, edges_of, neighbours

FLAT = 1e-6  # of its bounding box: less volume is none
MOST = 500  # closed parts: more are the specks of a scan
SPECK = 0.01  # of the whole's width
FAR = 10  # widths from the origin
SAMPLES, AGREE = 5000, 0.985  # points of the bounding box where two rules of what is inside are compared


def closed_parts(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> list[Any]:
    """Cut a surface into its closed parts.

    Args:
        vertices: (V, 3).
        triangles: (F, 3).

    Returns:
        The parts, each a closed trimesh that faces outwards.

    Raises:
        ValueError: where one has a hole, no inside or faces inwards, or where there are too many.
    """
    trimesh = extras.load("trimesh", "meshes", "a shape from a file")
    surface = trimesh.Trimesh(vertices, triangles, process=False)
    surface.merge_vertices(merge_tex=True, merge_norm=True)
    parts = _apart(trimesh, surface)
    for part in parts:
        if _is_flat(part):
            raise ValueError(f"has no volume: a part of it is flat, {part.extents.tolist()} wide")
        if not part.is_winding_consistent or _volume(part) < 0:
            raise ValueError("is turned inside out or hollow: the triangles of a part of it do not all face outwards")
    return parts


def union(parts: list[Any]) -> Any:
    """Unite the parts of a surface.

    Args:
        parts: of `closed_parts`.

    Returns:
        The surface of all together, a trimesh.

    Raises:
        ValueError: where it crosses itself, so that no rule says what is inside.
    """
    trimesh = extras.load("trimesh", "meshes", "a shape from a file")
    surface = parts[0]
    if len(parts) > 1:
        bounds = np.array([[part.bounds[0] for part in parts], [part.bounds[1] for part in parts]])
        low, high = bounds[0].min(axis=0), bounds[1].max(axis=0)
        width = float((high - low).max())
        # It is found with single precision, so not far from the origin.
        away = (low + high) / 2 if np.abs([low, high]).max() > FAR * width else np.zeros(3)
        surface = trimesh.boolean.union(
            [part.copy().apply_translation(-away) for part in parts] if away.any() else parts
        )
        if len(surface.faces) == 0 or np.abs(surface.bounds + away - [low, high]).max() > 1e-5 * width:
            raise ValueError("has parts that cannot be joined to one solid")
        surface.vertices = surface.vertices + away if away.any() else surface.vertices
    places = np.random.default_rng(0).uniform(surface.bounds[0], surface.bounds[1], (SAMPLES, 3))
    inside = distance_from(surface.vertices, surface.faces, places) < 0
    agree = float((inside == inside_of(surface.vertices, surface.faces, places)).mean())
    if agree < AGREE:
        raise ValueError(
            f"crosses or overlaps itself: of {1 - agree:.0%} of its bounding box nobody can say whether it is inside; "
            "repair it, e.g. by a union or a voxel remesh"
        )
    return surface


def _real(faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which of `faces` (T, 3) have three corners, and which of those are left without twins and pairs back to back."""
    low = np.sort(faces, axis=1)
    real = np.flatnonzero((low[:, 0] != low[:, 1]) & (low[:, 1] != low[:, 2]))
    key = (low[real] * (int(faces.max()) + 1) ** np.array([2, 1, 0])).sum(axis=1)  # below 2⁶³ for 1.5 million corners
    _, which, count = np.unique(key, return_inverse=True, return_counts=True)
    if (count == 1).all():
        return real, real
    start = np.argmin(faces, axis=1)[:, None]
    turned = np.take_along_axis(faces, (start + [0, 1, 2]) % 3, axis=1)  # the least corner first, as it is wound
    sign = np.where(turned[:, 1] < turned[:, 2], 1, -1)[real]
    more = np.sign(np.bincount(which, weights=sign)).astype(np.int64)[which]
    kept = np.flatnonzero(sign == more)
    return real, np.sort(real[kept[np.unique(which[kept], return_index=True)[1]]])


def _apart(trimesh: Any, surface: Any) -> list[Any]:
    """The closed parts of `surface`, which loses triangles that bound nothing; raises `ValueError` where it is open."""
    faces = surface.faces
    real, once = _real(faces)
    if len(once) == 0:
        wide = _wide(surface.vertices)
        raise ValueError(f"has no volume: it is flat, or all faces are there from both sides, {wide} wide")
    edges = edges_of(faces[once])
    if (edges.run == 2).all() and not edges.balance.any():
        surface.update_faces(once)
        return _split(trimesh, surface, surface.face_adjacency)
    whole = surface.submesh([real], append=True, repair=False)  # faces back to back are of two bodies that touch
    meeting = edges_of(whole.faces)
    if not meeting.balance.any():
        beside = np.vstack([whole.face_adjacency, neighbours(whole.vertices, whole.faces, meeting)])
        parts = [part for part in _split(trimesh, whole, beside) if not _is_flat(part)]
        if parts and all(part.is_watertight for part in parts):
            return parts
    surface.update_faces(once)
    raise ValueError(_why_open(trimesh, surface, edges))


def _split(trimesh: Any, surface: Any, beside: NDArray[np.int64]) -> list[Any]:
    """The parts where each triangle is with those `beside` it (M, 2); raises `ValueError` where they are too many."""
    labels = trimesh.graph.connected_component_labels(beside, node_count=len(surface.faces))
    if labels.max() >= MOST:
        low, high = np.full((labels.max() + 1, 3), np.inf), np.full((labels.max() + 1, 3), -np.inf)
        np.minimum.at(low, labels, surface.triangles.min(axis=1))
        np.maximum.at(high, labels, surface.triangles.max(axis=1))
        small = int(((high - low).max(axis=1) < SPECK * surface.extents.max()).sum())
        raise ValueError(
            f"has {len(low):,} separate parts, at most {MOST} are taken; {small:,} of them are smaller than "
            f"{SPECK:.0%} of it: remove the specks of the scan, keep its largest part"
        )
    return list(surface.split(only_watertight=False, adjacency=beside, repair=False))


def _why_open(trimesh: Any, surface: Any, edges: Edges) -> str:
    odd, turned = edges.run % 2 == 1, edges.balance != 0
    if not turned.any():
        return (
            f"touches itself at {int((edges.run > 2).sum())} edges where more than two triangles meet, and nobody can "
            "say which belong together: separate what touches there, or unite it"
        )
    if not odd.any():
        return (
            "is turned inside out or hollow: the triangles of a part of it do not all face outwards; at "
            f"{int(turned.sum())} edges two neighbours face opposite ways"
        )
    labels = trimesh.graph.connected_component_labels(surface.face_adjacency, node_count=len(surface.faces))
    parts = len(np.unique(labels[np.flatnonzero(odd[edges.which]) // 3]))
    alone, several = int((edges.run == 1).sum()), int((odd & (edges.run > 1)).sum())
    told = [f"{alone} belong to one alone"] * bool(alone) + [f"{several} to three or more"] * bool(several)
    where = f", in {parts:,} of its {labels.max() + 1:,} separate parts" if labels.max() else ""
    advice = "close its holes" if alone else "remove the walls inside it"
    return (
        f"is not watertight: {int(odd.sum())} edges do not join two triangles ({', '.join(told)}){where}; {advice}"
        + " or what is loose" * bool(labels.max())
    )


def _is_flat(part: Any) -> bool:
    return bool(abs(_volume(part)) <= FLAT * np.prod(part.extents))


def _volume(part: Any) -> float:
    a, b, c = (part.triangles - part.bounds.mean(axis=0)).transpose(1, 0, 2)
    return float((np.cross(a, b) * c).sum() / 6)


def _wide(vertices: NDArray[np.float64]) -> list[float]:
    return np.ptp(vertices, axis=0).round(9).tolist()
