"""Closed solids from triangles: bodies that touch are one, what has no clear inside is refused with the reason."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import trimesh

from haptic_env import shapes
from haptic_env.shapes import closed, mesh
from tests.haptic_env import meshes

SIDE = 0.04


def _cube(at: tuple[int, int, int], other: int = 0) -> trimesh.Trimesh:
    """A cube of `SIDE` at a place of a grid; the first `other` of its faces are cut along their other diagonals."""
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    faces = []
    sides = [0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]
    for number, (a, b, c, d) in enumerate(sides):
        faces += [[b, c, d], [b, d, a]] if number < other else [[a, b, c], [a, c, d]]
    return trimesh.Trimesh(SIDE * (corners + at), faces, process=False)


def _changed(surface: trimesh.Trimesh, faces: np.ndarray, corners: np.ndarray | None = None) -> trimesh.Trimesh:
    return trimesh.Trimesh(surface.vertices if corners is None else corners, faces, process=False)


def _volume(path: str) -> float:
    return float(shapes.find(path)._surface.volume) / SIDE**3


PLACES = {
    "face to face": [(0, 0, 0), (1, 0, 0)],
    "edge to edge": [(0, 0, 0), (1, 1, 0)],
    "corner to corner": [(0, 0, 0), (1, 1, 1)],
    "a row": [(0, 0, 0), (1, 0, 0), (2, 0, 0)],
    "a block": list(itertools.product((0, 1), repeat=3)),
    "an L": [(0, 0, 0), (1, 0, 0), (0, 1, 0)],
    "around an edge": [(0, 0, 0), (1, 1, 0), (0, 0, 1)],
    "twice": [(0, 0, 0), (0, 0, 0)],
}


@pytest.mark.parametrize("cut", ["alike", "otherwise", "some"])
@pytest.mark.parametrize("suffix", mesh.SUFFIXES)
@pytest.mark.parametrize("places", PLACES)
def test_bodies_that_touch_are_one_solid(tmp_path, places, suffix, cut):
    rng = np.random.default_rng(0)
    other = {"alike": lambda at: 0, "otherwise": lambda at: 6 * (sum(at) % 2), "some": lambda _: int(rng.integers(7))}
    cubes = [_cube(at, other[cut](at)) for at in PLACES[places]]
    path = meshes.save(trimesh.util.concatenate(cubes), tmp_path / f"cubes{suffix}")
    assert _volume(path) == pytest.approx(len(set(PLACES[places])), rel=1e-5)
    found = shapes.find(path)
    points = rng.uniform(-0.1, 1.1, (2000, 3)) * found.extents
    inside = np.isin(np.floor(points / SIDE).astype(int) @ [100, 10, 1], np.array(PLACES[places]) @ [100, 10, 1])
    distance = found.signed_distance(points - found.extents / 2, found.extents)
    assert not (((distance < 0) != inside) & (np.abs(distance) > 1e-6)).any()


@pytest.mark.parametrize("places", ["face to face", "edge to edge", "a row"])
def test_bodies_that_touch_are_told_apart(tmp_path, places):
    cubes = [_cube(at, 6 * (sum(at) % 2)) for at in PLACES[places]]
    found = shapes.find(meshes.save(trimesh.util.concatenate(cubes), tmp_path / "cubes.ply"))
    assert [part.volume / SIDE**3 for part in found._parts] == pytest.approx([1] * len(cubes), rel=1e-5)


def test_a_loose_triangle_of_both_sides_is_no_part_of_bodies_that_touch(tmp_path):
    cubes = trimesh.util.concatenate([_cube((0, 0, 0)), _cube((1, 0, 0), 6)])
    corners = [[0.01, 0.01, 0.01], [0.03, 0.01, 0.01], [0.01, 0.03, 0.02]]
    loose = trimesh.Trimesh(corners, [[0, 1, 2], [2, 1, 0]], process=False)
    path = meshes.save(trimesh.util.concatenate([cubes, loose]), tmp_path / "cubes.ply")
    assert _volume(path) == pytest.approx(2, rel=1e-5)
    assert len(shapes.find(path)._parts) == 2


def test_a_body_that_is_there_twice_and_cut_otherwise_is_one(tmp_path):
    path = meshes.save(trimesh.util.concatenate([_cube((0, 0, 0)), _cube((0, 0, 0), 3)]), tmp_path / "cubes.ply")
    assert _volume(path) == pytest.approx(1, rel=1e-5)


def test_bodies_that_share_corners_in_the_file_are_one_solid(tmp_path):
    """As a modeller writes them: each corner once, two faces back to back."""
    path = tmp_path / "shared.obj"
    corners = [(x, y, z) for x in range(3) for y in (0, 1) for z in (0, 1)]
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[i + 4 * body for i in side] for body in (0, 1) for side in sides]
    path.write_bytes(meshes.obj(SIDE * np.array(corners, dtype=float), faces))
    assert _volume(str(path)) == pytest.approx(2)


def _ball(level: int = 2) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=level, radius=0.03)


HARMLESS = {
    "faces twice": lambda ball: np.vstack([ball.faces, ball.faces[:50]]),
    "all twice": lambda ball: np.vstack([ball.faces, ball.faces]),
    "turned corners": lambda ball: np.vstack([ball.faces, np.roll(ball.faces[:50], 1, axis=1)]),
    "there thrice, once turned": lambda ball: np.vstack([ball.faces[:50, ::-1], ball.faces[:50], ball.faces]),
    "no area": lambda ball: np.vstack([ball.faces, ball.faces[:50, [0, 0, 1]], ball.faces[:9, [0, 0, 0]]]),
    "a fin of both sides": lambda ball: np.vstack([ball.faces, [[0, 50, 100], [100, 50, 0]]]),
}


@pytest.mark.parametrize("suffix", mesh.SUFFIXES)
@pytest.mark.parametrize("what", HARMLESS)
def test_triangles_that_bound_nothing_are_dropped(tmp_path, what, suffix):
    ball = _ball()
    path = meshes.save(_changed(ball, HARMLESS[what](ball)), tmp_path / f"ball{suffix}")
    found = shapes.find(path)
    assert len(found._surface.faces) == len(ball.faces)
    assert float(found._surface.volume) == pytest.approx(ball.volume, rel=1e-4)


def _specks(count: int, opened: bool) -> trimesh.Trimesh:
    speck = trimesh.creation.icosahedron()
    at = np.random.default_rng(0).uniform(-0.06, 0.06, (count, 1, 3))
    corners = (0.0003 * speck.vertices + at).reshape(-1, 3)
    faces = (speck.faces[opened:] + 12 * np.arange(count)[:, None, None]).reshape(-1, 3)
    return trimesh.util.concatenate([_ball(), trimesh.Trimesh(corners, faces, process=False)])


def _soup(count: int) -> trimesh.Trimesh:
    corners = np.random.default_rng(0).uniform(-0.05, 0.05, (3 * count, 3))
    return trimesh.Trimesh(corners, np.arange(3 * count).reshape(-1, 3), process=False)


def _noise(by: float) -> trimesh.Trimesh:
    ball = _ball(3)
    return _changed(ball, ball.faces, ball.vertices + np.random.default_rng(0).normal(0, by, ball.vertices.shape))


def _hollow() -> trimesh.Trimesh:
    inner = _ball()
    inner.apply_scale(0.5)
    inner.invert()
    return trimesh.util.concatenate([_ball(), inner])


def _fan() -> trimesh.Trimesh:
    """A bracket whose two ends are cut as fans from a corner that does not see all others: they fold over."""
    corners, faces = meshes.prism(meshes.BRACKET, 0.04, first=1)
    triangles = [[face[0], *face[k : k + 2]] for face in faces for k in range(1, len(face) - 1)]
    return trimesh.Trimesh(corners, triangles, process=False)


WRONG = {
    "specks": (lambda: _specks(5000, False), r"5,001 separate parts, at most 500 are taken; 5,000 of them are smaller"),
    "scraps": (
        lambda: _specks(1000, True),
        r"3000 edges .*\(3000 belong to one alone\), in 1,000 of its 1,001 sep.*loose",
    ),
    "soup": (lambda: _soup(5000), "not watertight: 15000 edges do not join two triangles"),
    "hole": (
        lambda: _changed(_ball(), _ball().faces[1:]),
        r"3 edges do not .*\(3 belong to one alone\); close its holes",
    ),
    "wall": (
        lambda: _changed(_ball(), np.vstack([_ball().faces, [[*_ball().faces[0][:2], 100]]])),
        r"3 edges .*\(2 belong to one alone, 1 to three or more\)",
    ),
    "turned": (
        lambda: _changed(_ball(), np.vstack([_ball().faces[:9, ::-1], _ball().faces[9:]])),
        r"turned inside out or hollow: .* at \d+ edges two neighbours face opposite ways",
    ),
    "inside out": (lambda: _changed(_ball(), _ball().faces[:, ::-1]), "turned inside out or hollow"),
    "hollow": (_hollow, "turned inside out or hollow"),
    "both sides": (lambda: _changed(_ball(), np.vstack([_ball().faces, _ball().faces[:, ::-1]])), "from both sides"),
    "crossing": (lambda: _noise(0.004), r"crosses or overlaps itself: of \d+% of its bounding box"),
    "folded": (_fan, "crosses or overlaps itself"),
    "flat": (lambda: _changed(_ball(), _ball().faces, _ball().vertices * [1, 1, 1e-9]), "has no volume|both sides"),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_solid_without_a_clear_inside_is_refused_with_the_reason(tmp_path, what):
    make, why = WRONG[what]
    path = meshes.save(make(), tmp_path / "wrong.ply")
    with pytest.raises(ValueError, match=rf"mesh '.*wrong\.ply' .*({why})"):
        shapes.make(path)


@pytest.mark.parametrize("by", [0.0, 0.0001])
def test_a_rough_surface_is_no_crossing_one(tmp_path, by):
    assert shapes.find(meshes.save(_noise(by), tmp_path / "rough.ply"))


@pytest.mark.parametrize("away", [0.0, 10.0, 1000.0])
def test_parts_are_joined_as_well_far_from_the_origin(tmp_path, away):
    both = trimesh.util.concatenate(
        [meshes.box((0.06, 0.02, 0.02)), meshes.box((0.02, 0.06, 0.02), (0.01, 0.0, 0.001))]
    )
    both.apply_translation((away, -away, 0.0))
    path = tmp_path / "cross.obj"
    path.write_bytes(meshes.obj(both.vertices, both.faces))
    found = shapes.find(str(path))
    np.testing.assert_allclose(found.extents, (0.06, 0.06, 0.021), atol=1e-6)
    np.testing.assert_allclose(found.centre, (away, -away, 0.0005), atol=1e-6)


def test_far_away_it_is_refused(tmp_path):
    solid = meshes.box((0.06, 0.02, 0.02), (1e5, 0.0, 0.0))
    path = tmp_path / "far.obj"
    path.write_bytes(meshes.obj(solid.vertices, solid.faces))
    with pytest.raises(ValueError, match=r"far\.obj' lies 100000 from its origin and is 0\.06 wide: move it"):
        shapes.make(str(path))


def test_what_a_slow_check_would_take_is_sampled(monkeypatch):
    """The whole box is looked at, whatever the mesh: as many places for each."""
    assert closed.SAMPLES >= 1000
    asked = []
    real = closed.inside_of
    monkeypatch.setattr(closed, "inside_of", lambda v, f, p: asked.append(len(p)) or real(v, f, p))
    closed.union([_ball()])
    assert asked == [closed.SAMPLES]


NAMES = [
    "brick [old].stl",
    "würfel.stl",
    "ⅷ 立方体.stl",
    "~brick.stl",
    "a'b\"c.stl",
    "%s{0}.stl",
    "-x.stl",
    "a..stl",
    ".b.stl",
]


@pytest.mark.parametrize("name", NAMES)
def test_any_name_of_a_file_is_a_shape(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    meshes.save(meshes.box((0.05, 0.04, 0.03)), tmp_path / "whole.stl")
    for place in (Path(name), tmp_path / "a [b] ~" / name):
        place.parent.mkdir(exist_ok=True)
        place.write_bytes((tmp_path / "whole.stl").read_bytes())
        env = gym.make("HapticSLAM/TwoFinger-v0", shape=str(place), reveal_truth=True)
        assert env.reset(seed=0)[1]["truth"]["shape"] == str(place)
        env.close()
        assert shapes.make(place).name == str(place)


def test_a_tilde_is_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    (tmp_path / "in").mkdir()
    monkeypatch.chdir(tmp_path / "in")
    meshes.save(meshes.box((0.05, 0.04, 0.03)), tmp_path / "box.stl")
    assert shapes.make("~/box.stl").size[0] == pytest.approx(0.05)
    (tmp_path / "in" / "~").mkdir()
    meshes.save(meshes.box((0.06, 0.04, 0.03)), tmp_path / "in" / "~" / "box.stl")
    assert shapes.make("~/box.stl").size[0] == pytest.approx(0.06), "a folder of that name comes first"


@pytest.mark.parametrize(
    "name", ["~nobody-of-that-name/x.stl", "a\0b.stl", "\udcff.stl", "x" * 300 + ".stl", "loop.stl"]
)
def test_a_name_that_can_be_no_files_is_quoted(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    os.symlink("loop.stl", "loop.stl")
    with pytest.raises(ValueError, match=r"mesh '.*\.stl' cannot be read: ") as error:
        gym.make("HapticSLAM/TwoFinger-v0", shape=name)
    assert repr(name) in str(error.value)


POINTS = [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, 1e300], [1e7, 0, 0], [0, 0], 3.0, "far", [[0, 0, 0], [0, 0]]]


@pytest.mark.parametrize("shape", ["mesh", *shapes.SHAPES])
@pytest.mark.parametrize("points", POINTS)
def test_points_that_are_none_are_refused(tmp_path, shape, points):
    if shape == "mesh":
        shape = meshes.save(meshes.box((0.05, 0.04, 0.03)), tmp_path / "box.stl")
    with pytest.raises(ValueError, match=r"points must|inhomogeneous"):
        shapes.make(shape).signed_distance(points)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf, "1", None])
def test_a_scale_that_is_none_is_quoted(tmp_path, scale):
    path = meshes.save(meshes.box((0.05, 0.04, 0.03)), tmp_path / "box.stl")
    with pytest.raises(ValueError, match="scale must be a finite number"):
        shapes.default_size(path, scale)


@pytest.mark.parametrize("place", [{"position": (1e300, 0, 0)}, {"quaternion": (1e200, 0, 0, 0)}])
def test_a_pose_out_of_all_reach_is_refused(place):
    with pytest.raises(ValueError, match=r"object (position|quaternion) must lie in"):
        shapes.make("cube", **place)
