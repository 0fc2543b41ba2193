"""Mesh files: faces of any corners are read right, sizes are checked first, whatever is no mesh is refused by name."""

from __future__ import annotations

import os
import re
import struct
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import trimesh
from matplotlib.path import Path as Outline

from haptic_env import mesh_formats, shapes
from haptic_env.mesh_formats import polygons, text
from tests.haptic_env import meshes

BRACKET = meshes.BRACKET


def _wrong(path: Path, ring: np.ndarray, height: float) -> int:
    """How many of some points are on the wrong side of the prism that `path` should hold."""
    solid = shapes.make(str(path))
    low, high = ring.min(axis=0), ring.max(axis=0)
    points = np.random.default_rng(0).uniform([*low, 0], [*high, height], (4000, 3)) * 1.02
    distance = solid.signed_distance(points - solid.shape.centre)
    inside = Outline(ring).contains_points(points[:, :2]) & (points[:, 2] > 0) & (points[:, 2] < height)
    return int((((distance < 0) != inside) & (np.abs(distance) > 1e-6)).sum())


@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("writer", meshes.WRITERS)
def test_a_face_of_six_corners_is_the_same_whichever_it_begins_with(tmp_path, writer, first):
    write, suffix = meshes.WRITERS[writer]
    path = tmp_path / f"bracket{suffix}"
    path.write_bytes(write(*meshes.prism(BRACKET, 0.04, first)))
    assert _wrong(path, BRACKET, 0.04) == 0
    np.testing.assert_allclose(shapes.make(str(path)).size, (0.08, 0.08, 0.04))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("writer", ["obj counting back", "ply text", "ply big"])
def test_prisms_on_any_polygon_are_read_right(tmp_path, writer, seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 40))
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = rng.uniform(0.01, 0.05, (count, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
    if seed % 2:  # a corner in the middle of each edge
        ring = np.stack([ring, (ring + np.roll(ring, -1, axis=0)) / 2], axis=1).reshape(-1, 2)
    write, suffix = meshes.WRITERS[writer]
    path = tmp_path / f"star{suffix}"
    path.write_bytes(write(*meshes.prism(ring, 0.03, int(rng.integers(count)))))
    assert _wrong(path, ring, 0.03) == 0


def test_a_face_with_a_hole_is_read_right(tmp_path):
    """As it is written: one polygon that goes in to the hole, around it and back."""
    outer = [(0.0, 0.0), (0.06, 0.0), (0.06, 0.06), (0.0, 0.06)]
    inner = [(0.02, 0.02), (0.02, 0.04), (0.04, 0.04), (0.04, 0.02)]
    corners = np.array([(x, y, z) for z in (0.0, 0.02) for x, y in outer + inner])
    ring = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4]
    faces = [ring[::-1], [i + 8 for i in ring]]
    for loop in ([0, 1, 2, 3], [4, 5, 6, 7]):
        faces += [[a, b, b + 8, a + 8] for a, b in zip(loop, loop[1:] + loop[:1], strict=True)]
    path = tmp_path / "frame.obj"
    path.write_bytes(meshes.obj(corners, faces))
    solid = shapes.make(str(path))
    assert solid.shape._surface.volume == pytest.approx((0.06**2 - 0.02**2) * 0.02)
    assert solid.signed_distance((0.0, 0.0, 0.0)) == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("ring", "why"),
    [
        ([(0, 0), (0.04, 0.04), (0.04, 0), (0, 0.05)], "crosses itself"),
        ([(np.cos(a), np.sin(a)) for a in np.arange(5) * 4 * np.pi / 5], "crosses itself"),
        ([((1 + a) * np.cos(a), (1 + a) * np.sin(a)) for a in np.linspace(0, 3.8 * np.pi, 24)], "crosses itself"),
        ([(0, 0), (1, -1), (2, 1), (3, -1), (4, 0), (3, 1), (2, -1), (1, 1)], "crosses itself"),
    ],
)
def test_a_face_that_crosses_itself_is_refused(tmp_path, ring, why):
    path = tmp_path / "bow.obj"
    path.write_bytes(meshes.obj(*meshes.prism(np.array(ring), 0.04)))
    with pytest.raises(ValueError, match=rf"mesh '.*bow\.obj' has a face of {len(ring)} corners that {why}"):
        shapes.make(str(path))


def test_a_face_that_is_not_flat_is_refused(tmp_path):
    corners, faces = meshes.prism(BRACKET, 0.04)
    corners[7, 2] += 0.002
    path = tmp_path / "bent.ply"
    path.write_bytes(meshes.ply_text(corners, faces))
    with pytest.raises(ValueError, match=r"bent\.ply' has a face of 6 corners that is not flat: one lies 0\.0\d+ of"):
        shapes.make(str(path))
    corners[7, 2] -= 0.0019
    path.write_bytes(meshes.ply_text(corners, faces))
    assert shapes.make(str(path)).size[2] == pytest.approx(0.0401)


def _ply(head: str, tail: bytes = bytes(300)) -> bytes:
    return ("ply\n" + head + "end_header\n").encode() + tail


XYZ = "property float x\nproperty float y\nproperty float z\n"
LIST = "property list uchar int vertex_indices\n"
SMALL = b"0 0 0\n" * 30
BOMBS = {
    "corners.ply": _ply(f"format binary_little_endian 1.0\nelement vertex 4000000000\n{XYZ}element face 12\n{LIST}"),
    "text.ply": _ply(f"format ascii 1.0\nelement vertex 4000000000\n{XYZ}element face 12\n{LIST}", SMALL),
    "faces.ply": _ply(f"format ascii 1.0\nelement vertex 3\n{XYZ}element face 4000000000\n{LIST}", SMALL),
    "beyond.ply": _ply(f"format ascii 1.0\nelement vertex {10**18}\n{XYZ}element face 12\n{LIST}", SMALL),
    "list.ply": _ply(
        f"format binary_little_endian 1.0\nelement vertex 3\n{XYZ}element face 1\n"
        "property list uint int vertex_indices\n",
        bytes(36) + struct.pack("<I", 2**32 - 1) + bytes(300),
    ),
    "other.ply": _ply(
        f"format binary_little_endian 1.0\nelement edge 4000000000\nproperty int a\nelement vertex 3\n{XYZ}"
        f"element face 1\n{LIST}"
    ),
    "nothing.ply": _ply(f"format ascii 1.0\nelement edge 900000000000\nelement vertex 3\n{XYZ}element face 1\n{LIST}"),
    "binary.stl": bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(500),
}


@pytest.mark.parametrize("name", BOMBS)
def test_what_a_file_declares_is_held_against_its_size_first(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(BOMBS[name])
    why = "declares .* bytes follow" if name.endswith(".ply") else "declares 4,294,967,295 triangles, which are"
    why = {"list.ply": "has 1,431,655,765 corners or more, at most", "nothing.ply": "has 900,0.* corners or more"}.get(
        name, why
    )
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=rf"mesh '.*{name}' .*{why}"):
            shapes.make(str(path))
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


def test_a_file_of_many_triangles_is_refused_before_it_is_checked(tmp_path, monkeypatch):
    monkeypatch.setattr(polygons, "MOST", 1000)
    ball = trimesh.creation.icosphere(subdivisions=3)
    for suffix in (".stl", ".ply", ".obj"):
        path = meshes.save(ball, tmp_path / f"ball{suffix}")
        with pytest.raises(ValueError, match=r"ball\.\w+' has 1,\d+ triangles or more, at most 1,000 are taken"):
            shapes.make(path)


LIMITS = {
    "LINES": (text, 10, "obj", "has more than 10 lines"),
    "LONGEST": (text, 8, "obj", "line 1 has 1. characters, more than 8"),
    "CORNERS": (polygons, 5, "ply big", "has a face of 6 corners, 3 to 5 are taken"),
    "LARGEST": (mesh_formats, 100, "ply little", r"has \d+ bytes, at most 100 are taken"),
    "MOST": (polygons, 4, "ply with more", "has 8 triangles or more, at most 4 are taken"),
}


@pytest.mark.parametrize("limit", LIMITS)
def test_what_would_take_long_is_refused(tmp_path, monkeypatch, limit):
    where, value, writer, why = LIMITS[limit]
    monkeypatch.setattr(where, limit, value)
    write, suffix = meshes.WRITERS[writer]
    path = tmp_path / f"bracket{suffix}"
    path.write_bytes(write(*meshes.prism(BRACKET, 0.04)))
    with pytest.raises(ValueError, match=rf"bracket{suffix}' .*{why}"):
        shapes.make(str(path))


def test_a_list_that_nobody_wants_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(polygons, "MOST", 1000)
    path = tmp_path / "long.ply"
    head = (
        f"format binary_little_endian 1.0\nelement vertex 3\nproperty list uint uchar junk\n{XYZ}element face 1\n{LIST}"
    )
    path.write_bytes(_ply(head, struct.pack("<I", 30_000) + bytes(30_000 + 100)))
    with pytest.raises(ValueError, match=r"long\.ply' has 10,000 corners or more"):
        shapes.make(str(path))


def test_only_the_file_itself_is_opened(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "other.mtl").write_text("newmtl a\nmap_Kd other.png\n")
    (tmp_path / "other.png").write_bytes(b"")
    box = trimesh.creation.box((0.04, 0.05, 0.06))
    opened: list[str] = []
    watching = [True]
    sys.addaudithook(lambda event, told: opened.append(str(told[0])) if watching and event == "open" else None)
    try:
        path = tmp_path / "in" / "box.obj"
        path.write_text("mtllib ../other.mtl\nusemtl a\n" + box.export(file_type="obj"))
        shapes.make(str(path))
        path = tmp_path / "in" / "box.ply"
        path.write_bytes(
            meshes.ply_text(box.vertices, box.faces).replace(
                b"\nelement", b"\ncomment TextureFile ../other.png\nelement", 1
            )
        )
        shapes.make(str(path))
    finally:
        watching.clear()
    assert {name for name in opened if str(tmp_path) in name} == {
        str(tmp_path / "in" / f"box.{s}") for s in ("obj", "ply")
    }


CUBE = meshes.obj(*meshes.prism(np.array([(0, 0), (0.05, 0), (0.05, 0.05), (0, 0.05)]), 0.05))
FACE = f"format ascii 1.0\nelement vertex 3\n{XYZ}element face 1\n"
THREE = b"0 0 0\n1 0 0\n0 1 0\n"
NO_MESH = {
    "empty.stl": (b"", "has 0 bytes, too few"),
    "empty.obj": (b"", "has no triangles"),
    "empty.ply": (b"", "does not begin with 'ply'"),
    "zero.stl": (bytes(84), "has no triangles"),
    "short.stl": (
        bytes(80) + struct.pack("<I", 2) + bytes(50),
        "declares 2 triangles, which are 184 bytes, and has 134",
    ),
    "unended.stl": (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "ends before its last endsolid"),
    "words.stl": (b"solid a\nouter loop\nvertex 0 zero 0\n", r"line 3: 3 numbers are needed, got '0 zero 0'"),
    "four.stl": (b"solid a\nouter loop\n" + b"vertex 0 0 0\n" * 4 + b"endloop\nendsolid", "a facet of 4 corners"),
    "word.obj": (CUBE + b"\nf 1 2 three", "line 15: a whole number is needed, got 'three'"),
    "none.obj": (CUBE + b"\nf 1 2 0", "line 15: a face names corner 0, 8 are above it"),
    "above.obj": (CUBE + b"\nf 1 2 -9", "line 15: a face names corner -9, 8 are above it"),
    "beyond.obj": (CUBE + b"\nf 1 2 9", "a face names corner 8 of 8, counted from 0"),
    "huge.obj": (CUBE + b"\nf 1 2 99999999999999999999", "a whole number is needed, got '9{20}'"),
    "two.obj": (CUBE + b"\nf 1 2", "has a face of 2 corners"),
    "flat.obj": (b"v 0 0\n" + CUBE, "line 1: 3 numbers are needed, got '0 0'"),
    "nan.obj": (CUBE.replace(b"v 0.05", b"v nan", 1), r"has 1 corners that are not finite, e\.g\. \[nan"),
    "inf.obj": (CUBE.replace(b"v 0.05", b"v 1e999", 1), r"has 1 corners that are not finite, e\.g\. \[inf"),
    "wide.obj": (CUBE.replace(b"0.05", b"1e200"), r"is 1e\+200 wide"),
    "narrow.obj": (CUBE.replace(b"0.05", b"1e-200"), "is 1e-200 wide"),
    "line.obj": (b"f " + b"1 " * 600_000, "line 1 has 1,200,002 characters"),
    "unended.ply": (b"ply\nformat ascii 1.0\n", "its header does not end"),
    "format.ply": (b"ply\nformat ebcdic 1.0\nend_header\n", "its header has a line 'format ebcdic 1.0'"),
    "type.ply": (_ply(FACE + "property list uchar quad vertex_indices\n"), "a line 'property list uchar quad"),
    "size.ply": (_ply(FACE + "property list float int vertex_indices\n"), "a line 'property list float int"),
    "fewer.ply": (_ply("element vertex -3\n"), "a line 'element vertex -3'"),
    "strip.ply": (
        _ply(FACE + "property list uchar int strips\n", THREE + b"3 0 1 2\n"),
        "has no list of whole numbers",
    ),
    "real.ply": (_ply(FACE + "property list uchar float vertex_indices\n", THREE + b"3 0 1 2\n"), "no list of whole"),
    "plane.ply": (
        _ply((FACE + LIST).replace("property float z\n", ""), THREE + b"3 0 1 2\n"),
        "its vertex has no x y z",
    ),
    "cut.ply": (_ply(FACE + LIST, THREE + b"3 0 1\n"), "its face is cut short"),
    "minus.ply": (_ply(FACE + LIST, THREE + b"-3 0 1 2\n"), "its face is cut short"),
    "outside.ply": (_ply(FACE + LIST, THREE + b"3 0 1 3\n"), "a face names corner 3 of 3"),
    "ends.ply": (_ply(FACE + LIST, THREE[:-6] + b" " * 20), "ends before the last of 3 of vertex"),
}


@pytest.mark.parametrize("name", NO_MESH)
def test_what_is_no_mesh_is_refused_with_the_reason(tmp_path, name):
    content, why = NO_MESH[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ValueError, match=rf"mesh '.*{re.escape(name)}' .*({why})"):
        shapes.make(str(path))


def test_a_folder_or_a_pipe_is_no_mesh(tmp_path):
    (tmp_path / "folder.stl").mkdir()
    names = ["folder.stl"]
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.stl")
        names.append("pipe.stl")
    for name in names:
        with pytest.raises(ValueError, match=f"{name}' is no file"):
            shapes.make(str(tmp_path / name))


def _whole(kind: str) -> tuple[bytes, str]:
    corners, faces = meshes.prism(BRACKET, 0.04)
    if kind in meshes.WRITERS:
        write, suffix = meshes.WRITERS[kind]
        return write(corners, faces), suffix
    solid = meshes.box((0.04, 0.05, 0.06))
    return (solid.export(file_type="stl") if kind == "stl" else solid.export(file_type="stl_ascii").encode()), ".stl"


@pytest.mark.parametrize("kind", [*meshes.WRITERS, "stl", "stl text"])
def test_a_file_that_is_cut_or_damaged_is_read_or_refused(tmp_path, kind):
    """And nothing else happens: no other error, no number that is none."""
    whole, suffix = _whole(kind)
    rng = np.random.default_rng(0)
    path = tmp_path / f"damaged{suffix}"
    refused = 0
    for trial in range(40):
        content = bytearray(whole)
        if trial % 2:
            del content[int(rng.integers(len(whole))) :]
        else:
            content[int(rng.integers(len(whole)))] = int(rng.integers(256))
        path.write_bytes(content)
        why = _why_refused(path)
        refused += why is not None
        assert why is None or path.name in why
    assert refused


def _why_refused(path: Path) -> str | None:
    try:
        found = shapes.find(str(path))
    except ValueError as error:
        return str(error)
    assert np.isfinite(found.signed_distance(np.zeros((1, 3)), found.extents)).all()
    return None
