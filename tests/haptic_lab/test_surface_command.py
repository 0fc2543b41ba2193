"""`haptic-slam explore --mesh`: the surface as a file, a table and a picture."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from mpl_toolkits.mplot3d import proj3d

from haptic_env import shapes
from haptic_lab.commands.explore import main, parse
from haptic_lab.exploration.surface_picture import picture
from observer.surface import Surface
from observer.surface.metrics import MM, true_mesh

SHORT = ["--shape", "cube", "--seconds", "1.5", "--particles", "4", "--seed", "3"]


def _refused(capsys, arguments: list[str]) -> str:
    with pytest.raises(SystemExit) as ended:
        parse(arguments)
    assert ended.value.code == 2
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1
    return said


@pytest.fixture
def ball(tmp_path):
    """The file of an object."""
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=2, radius=0.025).export(path)
    return str(path)


def test_a_surface_is_written(tmp_path, capsys):
    out, path = tmp_path / "out", tmp_path / "cube.ply"
    assert main([*SHORT, "--mesh", str(path), "--out", str(out)]) == 0
    assert trimesh.load(path, force="mesh").is_watertight
    assert (out / "surface.png").read_bytes().startswith(b"\x89PNG")
    score = json.loads((out / "explore.json").read_text())["mesh"]
    assert 0 < score["chamfer_felt_mm"] < 5
    said = capsys.readouterr().out
    assert "Chamfer distance, of the part that was felt" in said
    assert "cube.ply" in said


def test_nothing_touched_is_said_and_nothing_written(tmp_path, capsys):
    out, path = tmp_path / "out", tmp_path / "cube.ply"
    short = ["--shape", "cube", "--seconds", "0.1", "--particles", "2"]
    arguments = [*short, "--save-mesh", str(path)]
    assert main([*arguments, "--out", str(out)]) == 0
    assert "Nothing was touched: the surface is empty" in capsys.readouterr().out
    assert not path.exists()
    assert not (out / "surface.png").exists()


@pytest.mark.parametrize("flag", ["--mesh", "--save-mesh"])
@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("cube.foo", ".ply, .stl, .obj, .glb, .xyz, got"),
        ("cube", ".ply, .stl, .obj, .glb, .xyz, got"),
        ("nowhere/cube.ply", "a folder that can be written to"),
        ("folder.ply", "something else"),
    ],
)
def test_a_file_that_cannot_be_written_is_refused_before_all_else(tmp_path, capsys, flag, name, told):
    (tmp_path / "folder.ply").mkdir()
    assert told in _refused(capsys, [*SHORT, flag, str(tmp_path / name), "--out", str(tmp_path / "out")])
    assert [each.name for each in tmp_path.iterdir()] == ["folder.ply"]


def test_mesh_alone_is_the_object_as_ever(ball, tmp_path):
    settings, _ = parse(["--mesh", ball])
    assert (settings.shape, settings.save_mesh) == (ball, None)
    settings, _ = parse(["--mesh", ball, "--save-mesh", str(tmp_path / "felt.stl")])
    assert (settings.shape, settings.save_mesh) == (ball, str(tmp_path / "felt.stl"))


def test_mesh_beside_a_shape_or_where_there_is_none_is_the_surface(ball, tmp_path):
    felt = str(tmp_path / "felt.stl")
    for shape in ("cube", ball):
        settings, _ = parse(["--shape", shape, "--mesh", felt])
        assert (settings.shape, settings.save_mesh) == (shape, felt)
    for _ in range(2):  # the second time it is there
        settings, _ = parse(["--mesh", felt])
        assert (settings.shape, settings.save_mesh) == (None, felt)
        mesh = trimesh.creation.icosphere(subdivisions=1, radius=0.025)
        Surface(np.array(mesh.vertices), np.array(mesh.faces), np.full(len(mesh.vertices), 0.001)).save(felt)


def test_three_meshes_are_one_too_many(ball, tmp_path, capsys):
    arguments = ["--shape", ball, "--mesh", str(tmp_path / "a.ply"), "--save-mesh", str(tmp_path / "b.ply")]
    assert "one mesh too many" in _refused(capsys, arguments)


@pytest.mark.parametrize("name", ["torus(0.4)", "cube", "capsule(4)"])
@pytest.mark.parametrize("off", [0.0, 0.02])
def test_nothing_is_cut_off_in_the_picture(name, off):
    solid = shapes.make(name)
    vertices, faces = true_mesh(solid)
    felt = Surface(1.2 * vertices + off, faces, np.full(len(vertices), 0.002))
    every = np.concatenate([felt.vertices, vertices])
    figure = picture(felt, solid, vertices[:3], "a title\nof two lines")
    figure.draw_without_rendering()
    middle = 0.5 * (every.min(axis=0) + every.max(axis=0))
    for axes in figure.axes[:4]:
        x, y, _ = proj3d.proj_transform(*(MM * (every - middle)).T, axes.get_proj())
        shown = axes.transAxes.inverted().transform(axes.transData.transform(np.column_stack([x, y])))
        assert ((shown > 0.0) & (shown < 1.0)).all()
