"""Objects from files: what is refused, the truth against known solids, convex pieces, real scans where they are."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import trimesh

from haptic_env import hands, scene, shapes
from haptic_env.shapes import mesh, pieces

OBJECTS = Path(__file__).parents[3] / "shared" / "objects"
REAL = [
    "YcbBanana_collision_vhacd.obj",
    "YcbGelatinBox_collision_vhacd.obj",
    "YcbMustardBottle_collision_vhacd.obj",
    "YcbTomatoSoupCan_collision_vhacd.obj",
    "cubemedium.stl",
    "cylinderlarge.stl",
    "spheremedium.stl",
]


@pytest.fixture(autouse=True)
def own_cache(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Decompositions are kept for these tests alone."""
    monkeypatch.setenv("HAPTIC_SLAM_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


def _box(size: tuple[float, float, float], at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    return trimesh.creation.box(size, trimesh.transformations.translation_matrix(at))


def _save(surface: trimesh.Trimesh | trimesh.PointCloud, path: Path) -> str:
    surface.export(path)
    return str(path)


@pytest.mark.parametrize("suffix", mesh.SUFFIXES)
def test_a_box_is_the_box_that_is_built_in(tmp_path, suffix):
    path = _save(_box((0.04, 0.05, 0.06), at=(0.3, 0.2, 0.1)), tmp_path / f"box{suffix}")
    solid, box = shapes.make(path), shapes.make("cube", (0.04, 0.05, 0.06))
    np.testing.assert_allclose(solid.size, box.size, atol=1e-6)
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (5, 400, 3))
    np.testing.assert_allclose(solid.signed_distance(points), box.signed_distance(points), atol=1e-6)
    np.testing.assert_allclose(solid.shape.centre, (0.3, 0.2, 0.1), atol=1e-6)


def test_the_size_is_what_is_said_whatever_the_unit(tmp_path):
    path = _save(_box((40, 50, 60)), tmp_path / "millimetres.stl")
    np.testing.assert_allclose(shapes.default_size(path, 0.001), (0.04, 0.05, 0.06))
    solid = shapes.make(path, (0.02, 0.025, 0.03))
    assert solid.signed_distance((0.011, 0.0, 0.0)) == pytest.approx(0.001, abs=1e-7)
    with pytest.raises(ValueError, match=r"only scaled as a whole, e\.g\. to \[0\.02, 0\.025, 0\.03\] m"):
        shapes.make(path, (0.02, 0.02, 0.03))


def test_distance_is_that_of_trimesh(tmp_path):
    torus = trimesh.creation.torus(0.03, 0.01, major_sections=24, minor_sections=12)
    solid = shapes.make(_save(torus, tmp_path / "torus.ply"))
    points = np.random.default_rng(1).uniform(-0.05, 0.05, (200, 3))
    expected = trimesh.proximity.closest_point_naive(torus, points)[1]
    np.testing.assert_allclose(np.abs(solid.signed_distance(points)), expected, atol=1e-6)
    assert solid.signed_distance((0.0, 0.0, 0.0)) == pytest.approx(0.02, abs=5e-4), "the hole is outside"
    assert solid.signed_distance((0.03, 0.0, 0.0)) < -0.009


def test_parts_that_overlap_are_one_solid(tmp_path):
    both = trimesh.util.concatenate([_box((0.04, 0.02, 0.02)), _box((0.02, 0.04, 0.02))])
    solid = shapes.make(_save(both, tmp_path / "cross.obj"))
    assert solid.signed_distance((0.0, 0.0, 0.0)) == pytest.approx(-0.01, abs=1e-6), "no surface is left inside"
    assert solid.signed_distance((0.01, 0.0, 0.0)) == pytest.approx(-0.01, abs=1e-6)
    hand = hands.make("two_finger")
    assert scene.compose(hand, solid).ngeom == len(hand.links) + 2


def test_a_concave_solid_is_touched_inside_its_hollow(tmp_path, monkeypatch):
    corner = trimesh.boolean.union([_box((0.06, 0.02, 0.02)), _box((0.02, 0.06, 0.02), at=(-0.02, 0.02, 0.0))])
    path = _save(corner, tmp_path / "corner.stl")
    parts = pieces.convex_pieces(trimesh.load_mesh(path), tolerance=0.0004)
    assert len(parts) == 2
    inside = np.random.default_rng(0).uniform(*corner.bounds, (2000, 3))
    inside = inside[pieces.distance_from(corner.vertices, corner.faces, inside) < 0]
    hulls = [trimesh.convex.convex_hull(part) for part in parts]
    deep = np.min([pieces.distance_from(hull.vertices, hull.faces, inside) for hull in hulls], axis=0)
    assert (deep < 0.0015).all(), "nothing is left out"
    monkeypatch.setattr("haptic_env.shapes.decomposition.cut", lambda *_: pytest.fail("it was found twice"))
    again = pieces.convex_pieces(trimesh.load_mesh(path), tolerance=0.0004)
    for first, second in zip(parts, again, strict=True):
        np.testing.assert_array_equal(first, second)


def _hole(path: Path) -> str:
    box = _box((0.04, 0.04, 0.04))
    box.update_faces(np.arange(len(box.faces)) > 1)
    return _save(box, path)


def _flat(path: Path) -> str:
    return _save(trimesh.Trimesh([[0, 0, 0], [0.04, 0, 0], [0, 0.04, 0]], [[0, 1, 2], [0, 2, 1]]), path)


def _inverted(path: Path) -> str:
    box = _box((0.04, 0.04, 0.04))
    box.invert()
    return _save(box, path)


def _cut(path: Path) -> str:
    whole = Path(_save(_box((0.04,) * 3), path)).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    return str(path)


def _text(path: Path) -> str:
    path.write_text("not a mesh")
    return str(path)


BAD = {
    "missing.stl": (str, "cannot be read: No such file"),
    "metres.stl": (
        lambda path: _save(_box((40, 40, 40)), path),
        r"is 40 × 40 × 40 m wide.*scale=0\.001 \(millimetres\)",
    ),
    "tiny.stl": (lambda path: _save(_box((1e-5,) * 3), path), r"1e-05 m wide, objects are 0\.005 to 0\.3 m$"),
    "hole.stl": (_hole, "is not watertight: 4 edges do not join two triangles"),
    "flat.ply": (_flat, "has no volume"),
    "inverted.obj": (_inverted, "turned inside out"),
    "points.ply": (lambda path: _save(trimesh.PointCloud(np.eye(3)), path), "has no triangles"),
    "text.stl": (_text, "has no triangles|cannot be read"),
    "text.ply": (_text, "cannot be read, it is no PLY or was cut short: "),
    "cut.ply": (_cut, "cannot be read, it is no PLY or was cut short: "),
    "cut.stl": (_cut, "or was cut short: it declares 12 triangles, which are 684 bytes, and has 342"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_is_no_solid_is_named(tmp_path, name):
    make, message = BAD[name]
    path = make(tmp_path / name)
    with pytest.raises(ValueError, match=rf"mesh '.*{name}' .*({message})"):
        gym.make("HapticSLAM/TwoFinger-v0", shape=path)


def test_another_kind_of_file_is_an_unknown_shape():
    with pytest.raises(
        ValueError, match=r"unknown shape 'cup\.step'; choose from cube.*a mesh \(\.stl, \.obj, \.ply\)"
    ):
        shapes.make("cup.step")


def test_a_file_that_changes_is_read_again(tmp_path):
    path = tmp_path / "box.stl"
    assert shapes.make(_save(_box((0.04,) * 3), path)).size[0] == pytest.approx(0.04)
    assert shapes.make(_save(_box((0.05,) * 3), path)).size[0] == pytest.approx(0.05)


def test_a_mesh_is_explored_like_any_shape(env_id, make, play, tmp_path):
    path = _save(_box((50, 50, 50)), tmp_path / "box.stl")
    env = make(env_id, shape=[path, "sphere"], scale=0.001, size_jitter=0.1, reveal_truth=True)
    drawn = {env.reset(seed=seed)[1]["truth"]["shape"] for seed in range(8)}
    assert drawn == {path, "sphere"}
    record = play(env, 0, 100, shape=path)
    truth = record[-1][4]["truth"]
    assert truth["shape"] == path
    assert 0.045 <= truth["object_size"][0] <= 0.055
    assert any(step[0]["contacts"].any() for step in record)


@pytest.mark.parametrize("name", REAL)
def test_real_objects_can_be_held(name):
    path = OBJECTS / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    solid = shapes.make(str(path))
    surface = trimesh.load_scene(path).to_mesh()
    np.testing.assert_allclose(solid.size, surface.extents)
    points = np.asarray(surface.sample(300, seed=0)) - solid.shape.centre
    distance = solid.signed_distance(points)
    assert distance.max() < 1e-6, "a point of any of its parts lies on its surface or inside"
    assert np.median(np.abs(distance)) < 1e-6


@pytest.mark.parametrize("hand", ["HapticSLAM/MyoHand-v0", "HapticSLAM/AdroitHand-v0"])
@pytest.mark.parametrize(
    "name", ["YcbTomatoSoupCan_collision_vhacd.obj", "YcbGelatinBox_collision_vhacd.obj", *REAL[-3:]]
)
def test_whole_hands_explore_real_objects(make, play, hand, name):
    path = OBJECTS / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    record = play(make(hand, shape=path), 0, 250)
    assert sum(int(step[0]["contacts"].any()) for step in record) > 25


def test_the_side_of_a_surface_is_not_that_of_a_needle_of_it(tmp_path, monkeypatch):
    """Pseudonormals of triangles without width are any: what they say far from the surface is mended."""
    path = _save(_box((0.05, 0.04, 0.03)), tmp_path / "box.stl")
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (2000, 3))
    right = shapes.make(path).signed_distance(points)
    real, wrong = mesh.distance_from, np.random.default_rng(1).random(len(points)) < 0.2
    monkeypatch.setattr(mesh, "distance_from", lambda *told: np.where(wrong, -1.0, 1.0) * real(*told))
    deep = np.abs(right) > 0.01 * 0.05
    np.testing.assert_array_equal(shapes.make(path).signed_distance(points)[deep], right[deep])


@pytest.mark.skipif(not OBJECTS.is_dir(), reason="the meshes of ../shared/objects are not there")
def test_a_teapot_has_no_inside_far_outside():
    teapot = shapes.make(str(OBJECTS / "teapot.stl"))
    points = np.random.default_rng(0).uniform(-0.17, 0.17, (20_000, 3))
    assert teapot.signed_distance(points).min() > -0.5 * min(teapot.size)
