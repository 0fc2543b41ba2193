"""Meshes to write and to read again: prisms on polygons, in every format."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

Faces = Sequence[Sequence[int]]
BRACKET = np.array([(0.0, 0.0), (0.08, 0.0), (0.08, 0.03), (0.03, 0.03), (0.03, 0.08), (0.0, 0.08)])


def prism(ring: NDArray[np.float64], height: float, first: int = 0) -> tuple[NDArray[np.float64], list[list[int]]]:
    """Corners (2K, 3) and faces of the prism on the polygon `ring` (K, 2): two of K corners that begin with corner
    `first`, and K of four."""
    count = len(ring)
    corners = np.vstack([np.column_stack([ring, np.full(count, z)]) for z in (0.0, height)])
    sides = [[i, (i + 1) % count, (i + 1) % count + count, i + count] for i in range(count)]
    below, above = np.roll(np.arange(count)[::-1], first + 1), np.roll(np.arange(count, 2 * count), -first)
    turned = [np.roll(side, -first).tolist() for side in sides]
    return corners, [below.tolist(), above.tolist(), *turned]


def box(size: Sequence[float], at: Sequence[float] = (0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    """A box about `at`."""
    return trimesh.creation.box(size, trimesh.transformations.translation_matrix(at))


def save(surface: trimesh.Trimesh | trimesh.PointCloud, path: Path) -> str:
    """Write `surface` to `path`, and return that."""
    surface.export(path)
    return str(path)


def obj(corners: NDArray[np.float64], faces: Faces) -> bytes:
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    return "\n".join(lines + ["f " + " ".join(str(i + 1) for i in face) for face in faces]).encode()


def obj_counting_back(corners: NDArray[np.float64], faces: Faces) -> bytes:
    """Each face below the corners up to its last one; texture and normal beside each, lines broken, Windows' ends."""
    lines, written = ["mtllib none.mtl", "vt 0 0", "vn 0 0 1"], 0
    for face in sorted(faces, key=max):
        lines += ["v {} {} {} 1 0 0".format(*corner) for corner in corners[written : max(face) + 1]]
        written = max(written, max(face) + 1)
        lines.append("f " + " \\\r\n ".join(f"{i - written}/1/-1" for i in face))
    return "\r\n".join(lines).encode()


def ply_text(corners: NDArray[np.float64], faces: Faces) -> bytes:
    lines = ["{} {} {}".format(*corner) for corner in corners] + [" ".join(map(str, [len(f), *f])) for f in faces]
    return ply_header("ascii", len(corners), len(faces)) + "\n".join(lines).encode()


def ply_little(corners: NDArray[np.float64], faces: Faces) -> bytes:
    return _ply_binary("<", "binary_little_endian", corners, faces)


def ply_big(corners: NDArray[np.float64], faces: Faces) -> bytes:
    return _ply_binary(">", "binary_big_endian", corners, faces)


def _ply_binary(order: str, name: str, corners: NDArray[np.float64], faces: Faces) -> bytes:
    rows = b"".join(struct.pack(order + "3d", *corner) for corner in corners)
    lists = b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces)
    return ply_header(name, len(corners), len(faces)) + rows + lists


def ply_with_more(corners: NDArray[np.float64], faces: Faces) -> bytes:
    """Other elements before and between, properties of every kind about those that are needed."""
    head = (
        b"ply\nformat binary_little_endian 1.0\ncomment by hand\nelement camera 1\nproperty list uchar float view\n"
        b"element vertex %d\nproperty uchar red\nproperty double z\nproperty double x\nproperty short s\n"
        b"property double y\nelement face %d\nproperty float quality\nproperty list ushort uint vertex_index\n"
        b"property list uchar float texcoord\nend_header\n"
    ) % (len(corners), len(faces))
    rows = b"".join(struct.pack("<Bddhd", 255, z, x, -1, y) for x, y, z in corners)
    lists = b"".join(struct.pack(f"<fH{len(f)}IB2f", 0.5, len(f), *f, 2, 0.0, 1.0) for f in faces)
    return head + struct.pack("<B3f", 3, 1, 2, 3) + rows + lists


def ply_header(kind: str, corners: int, faces: int) -> bytes:
    return (
        f"ply\nformat {kind} 1.0\nelement vertex {corners}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()


# What is written with faces of any number of corners; and the format
WRITERS: dict[str, tuple[Callable[[NDArray[np.float64], Faces], bytes], str]] = {
    "obj": (obj, ".obj"),
    "obj counting back": (obj_counting_back, ".obj"),
    "ply text": (ply_text, ".ply"),
    "ply little": (ply_little, ".ply"),
    "ply big": (ply_big, ".ply"),
    "ply with more": (ply_with_more, ".ply"),
}
