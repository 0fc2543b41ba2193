"""Files of surfaces: what is read back is what was written, and nothing is left where it cannot be."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import trimesh

from haptic_env import shapes
from observer.surface import Surface
from observer.surface.files import WRITERS, is_ours
from observer.surface.mesh import EMPTY

MESHES = [ending for ending in WRITERS if ending != ".xyz"]


@pytest.fixture
def surface():
    """A ball of 25 mm, surer at the top."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.025)
    return Surface(np.array(ball.vertices), np.array(ball.faces), 0.003 - 0.1 * np.array(ball.vertices)[:, 2])


@pytest.mark.parametrize("ending", MESHES)
def test_a_mesh_is_read_back(surface, tmp_path, ending):
    surface.save(tmp_path / f"ball{ending}")
    read = trimesh.load(tmp_path / f"ball{ending}", force="mesh")
    assert read.is_watertight
    assert read.volume == pytest.approx(trimesh.Trimesh(surface.vertices, surface.faces).volume, rel=1e-4)
    np.testing.assert_allclose(read.bounds, [surface.vertices.min(axis=0), surface.vertices.max(axis=0)], atol=1e-6)
    assert [each.name for each in tmp_path.iterdir()] == [f"ball{ending}"]


@pytest.mark.parametrize("ending", [".ply", ".stl", ".obj"])
def test_it_can_be_explored(surface, tmp_path, ending):
    surface.save(tmp_path / f"ball{ending}")
    size = shapes.default_size(str(tmp_path / f"ball{ending}"), 1.0)
    np.testing.assert_allclose(size, np.ptp(surface.vertices, axis=0), atol=1e-6)
    assert is_ours(tmp_path / f"ball{ending}")


def test_ply_has_the_std_of_each_vertex(surface, tmp_path):
    surface.save(tmp_path / "ball.ply")
    head, body = (tmp_path / "ball.ply").read_bytes().split(b"end_header\n")
    names = [line.split()[-1] for line in head.decode().splitlines() if line.startswith("property float")]
    assert names == ["x", "y", "z", "std"]
    rows = np.frombuffer(body, "<f4", 4 * len(surface.vertices)).reshape(-1, 4)
    np.testing.assert_allclose(rows, np.column_stack([surface.vertices, surface.std]), atol=1e-7)


def test_glb_has_the_std_of_each_vertex(surface, tmp_path):
    surface.save(tmp_path / "ball.glb")
    read = trimesh.load(tmp_path / "ball.glb", force="mesh", process=False)
    np.testing.assert_allclose(read.vertex_attributes["_STD"].ravel(), surface.std, atol=1e-7)
    assert (tmp_path / "ball.glb").read_bytes()[:4] == struct.pack("<4s", b"glTF")


def test_a_point_cloud_has_a_line_for_each_vertex(surface, tmp_path):
    surface.save(tmp_path / "ball.xyz")
    read = np.loadtxt(tmp_path / "ball.xyz")
    np.testing.assert_allclose(read, np.column_stack([surface.vertices, surface.std]), atol=1e-6)


@pytest.mark.parametrize("name", ["ball.foo", "ball", "ball.ply.gz", ".ply"])
def test_a_format_that_is_not_known_is_refused(surface, tmp_path, name):
    with pytest.raises(ValueError, match=r"\.ply, \.stl, \.obj, \.glb, \.xyz, got '.*'"):
        surface.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["nowhere/ball.ply", "file/ball.ply", "folder.ply", "n" * 300 + ".ply"])
def test_a_path_that_cannot_be_written_is_refused(surface, tmp_path, name):
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(ValueError, match="path of a surface"):
        surface.save(tmp_path / name)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["file", "folder.ply"]


@pytest.mark.parametrize("path", [None, 3, "", "a\nb.ply"])
def test_what_is_no_path_is_refused(surface, path):
    with pytest.raises(ValueError, match="path of a surface"):
        surface.save(path)


@pytest.mark.parametrize("ending", WRITERS)
def test_of_an_empty_surface_nothing_is_written(tmp_path, ending):
    with pytest.raises(ValueError, match="empty"):
        EMPTY.save(tmp_path / f"nothing{ending}")
    assert not list(tmp_path.iterdir())


def test_what_fails_leaves_the_file_that_was_there(surface, tmp_path, monkeypatch):
    path = tmp_path / "ball.ply"
    path.write_bytes(b"before")

    def fails(_):
        raise OSError("disk full")

    monkeypatch.setitem(WRITERS, ".ply", fails)
    with pytest.raises(OSError, match="disk full"):
        surface.save(path)
    assert path.read_bytes() == b"before"
    assert not is_ours(path)
