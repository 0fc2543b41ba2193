"""Bodies that touch along edges, told apart by where their insides are. T triangles, E edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST = 50_000  # edges where more than two triangles meet
ALIKE = 1e-6  # radians: directions closer than that are one


class Edges(NamedTuple):
    """The E edges of T triangles.

    Attributes:
        which: (3T,) the edge that each side of each triangle is.
        run: (E,) how many sides run along it.
        balance: (E,) how many more do in one direction than in the other: in a closed surface, none anywhere.
    """

    which: NDArray[np.int64]
    run: NDArray[np.int64]
    balance: NDArray[np.int64]


def edges_of(faces: NDArray[np.int64]) -> Edges:
    """Find the edges of triangles.

    Args:
        faces: (T, 3).

    Returns:
        The edges.
    """
    start, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, which, run = np.unique(low * (int(faces.max()) + 1) + high, return_inverse=True, return_counts=True)
    balance = np.bincount(which, weights=np.where(start < end, 1, -1))
    return Edges(which, run, balance.astype(np.int64))


def neighbours(vertices: NDArray[np.float64], faces: NDArray[np.int64], edges: Edges) -> NDArray[np.int64]:
    """Find the triangles that bound one body together, at all edges of a closed surface where more than two meet.

    Around an edge the inside begins at a triangle that runs against it and ends at one that runs along it. Where two
    lie back to back, one inside ends before the next begins; of a body that is there twice, one lies in the other.

    Args:
        vertices: (V, 3).
        faces: (T, 3).
        edges: of `faces`.

    Returns:
        (M, 2) triangles.

    Raises:
        ValueError: where more than two meet at more than `MOST` edges.
    """
    vertices, faces = np.asarray(vertices), np.asarray(faces)
    sides, first = np.argsort(edges.which, kind="stable"), np.cumsum(edges.run) - edges.run
    found: list[tuple[int, int]] = []
    several = np.flatnonzero(edges.run > 2)
    if len(several) > MOST:
        raise ValueError(
            f"touches itself at {len(several):,} edges, at most {MOST:,} are taken: unite what touches there"
        )
    for edge in several:
        face, place = np.divmod(sides[first[edge] : first[edge] + edges.run[edge]], 3)
        start, end, apex = (faces[face, (place + k) % 3] for k in range(3))
        along = start < end
        low, high = vertices[min(start[0], end[0])], vertices[max(start[0], end[0])]
        turn = np.round(_angles(high - low, vertices[apex] - low) / ALIKE) % round(2 * np.pi / ALIKE)
        order = np.lexsort((np.where(along, -face, face), ~along, turn))
        depth = np.cumsum(np.where(along[order], -1, 1))
        begun: list[int] = []
        least = int(np.argmin(depth)) + 1
        for each in [*order[least:], *order[:least]]:
            if along[each]:
                found.append((face[begun.pop()], face[each]))
            else:
                begun.append(each)
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _angles(axis: NDArray[np.float64], arms: NDArray[np.float64]) -> NDArray[np.float64]:
    """(M,) radians about `axis` (3,) from the first of `arms` (M, 3) to each."""
    axis = axis / np.linalg.norm(axis)
    across = arms - np.outer(arms @ axis, axis)
    x, y, z = across[0]
    ahead = np.array([axis[1] * z - axis[2] * y, axis[2] * x - axis[0] * z, axis[0] * y - axis[1] * x])
    return np.arctan2(across @ ahead, across @ across[0])
