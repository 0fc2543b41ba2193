"""Solids with parameters: their distance against brute force and MuJoCo, their names, and what is refused."""

from __future__ import annotations

import pickle

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull, cKDTree

from haptic_env import scene, shapes
from haptic_env.grid import Grid
from haptic_env.shapes import star_shaped
from haptic_env.shapes.sphere_points import directions

RADIUS = 0.004
EXACT, FACETS, CONES, WILD = 2e-5, 3e-4, 5e-4, 8e-4  # m by which the physics may be off
NAMES = {
    "capsule": EXACT,
    "capsule(1)": EXACT,
    "cone": FACETS,
    "cone(0.5)": FACETS,
    "cuboid(1, 2, 3)": EXACT,
    "ellipsoid": EXACT,
    "ellipsoid(1, 0.6, 2)": EXACT,
    "frustum(0.3, 1.5)": FACETS,
    "L": EXACT,
    "L(0.2, 1, size=(0.06, 0.05, 0.04))": EXACT,
    "noise(3)": CONES,
    "noise(4, 0.3)": WILD,
    "prism": EXACT,
    "prism(3)": EXACT,
    "prism(5, 0.5, size=0.07)": EXACT,
    "superquadric": FACETS,
    "superquadric(0.2, 1)": FACETS,
    "superquadric(1.5, 1.5)": FACETS,
    "torus": FACETS,
    "torus(0.45)": FACETS,
    "cylinder(size=(0.03, 0.03, 0.09))": EXACT,
}
VOLUMES = {
    "capsule(1)": np.pi / 6,
    "cone": np.pi / 12,
    "cuboid(1, 2, 3)": 1.0,
    "ellipsoid": np.pi / 6,
    "frustum(0.3, 1.5)": np.pi / 12 * (1 + 0.3 + 0.09),
    "L": 1 - 0.6**2,
    "prism(3)": 0.5,
    "torus": np.pi**2 / 4 * 0.7 * 0.3,
}
TURNED = {"position": (0.01, -0.02, 0.005), "quaternion": (0.8, 0.3, -0.4, 0.2)}


@pytest.fixture(params=NAMES)
def solid(request: pytest.FixtureRequest) -> shapes.Solid:
    return shapes.make(request.param, **TURNED)


def _points(solid: shapes.Solid, count: int, seed: int) -> np.ndarray:
    return np.asarray(solid.position) + np.random.default_rng(seed).uniform(-0.06, 0.06, (count, 3))


def _surface(solid: shapes.Solid) -> np.ndarray:
    """Points of the surface, where short random lines enter or leave it."""
    start, end = _points(solid, 60_000, seed=5), _points(solid, 60_000, seed=6)
    end = start + 0.02 * (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    crosses = (solid.signed_distance(start) < 0) != (solid.signed_distance(end) < 0)
    start, end = start[crosses], end[crosses]
    inwards = solid.signed_distance(end) < 0
    for _ in range(14):
        middle = 0.5 * (start + end)
        late = (solid.signed_distance(middle) < 0) == inwards
        start, end = np.where(late[:, None], start, middle), np.where(late[:, None], middle, end)
    return 0.5 * (start + end)


@pytest.mark.parametrize("name", ["cone(0.5)", "L", "noise(4, 0.3)", "prism(3)", "superquadric(1.5, 1.5)", "torus"])
def test_distance_is_that_to_the_nearest_point_of_the_surface(name):
    solid = shapes.make(name, **TURNED)
    points = _points(solid, 400, seed=1)
    brute, _ = cKDTree(_surface(solid)).query(points)
    distance = np.abs(solid.signed_distance(points))
    assert (distance <= brute + 3e-5).all()
    assert np.quantile(brute - distance, 0.9) < 0.001  # as near as the points of the surface lie to each other


def test_distance_changes_no_faster_than_the_point_moves(solid):
    first = _points(solid, 3_000, seed=2)
    second = first + np.random.default_rng(3).normal(0.0, 0.001, first.shape)
    change = np.abs(solid.signed_distance(first) - solid.signed_distance(second))
    assert (change <= np.linalg.norm(first - second, axis=1) + 1e-6).all()


def test_solid_fills_its_bounding_box_and_its_known_volume(solid):
    grid = Grid.around(np.zeros(3), np.asarray(solid.size) * 1.06, 0.0014)
    centres = grid.centres()
    inside = solid.shape.signed_distance(centres, np.asarray(solid.size)) < 0
    own = centres[inside]
    np.testing.assert_allclose(own.max(axis=0), np.array(solid.size) / 2, atol=0.004)
    np.testing.assert_allclose(own.min(axis=0), -np.array(solid.size) / 2, atol=0.004)
    if solid.name in VOLUMES:
        assert inside.sum() * 0.0014**3 == pytest.approx(VOLUMES[solid.name] * np.prod(solid.size), rel=0.03)


def test_mujoco_sees_the_same_surface(solid, probe):
    """A probe sphere touches where its centre is nearer than its radius, and as deep as the distance says."""
    tolerance = NAMES[solid.name]
    model = scene.compose(probe, solid)
    data = mujoco.MjData(model)
    scene.place(model, data, solid)
    points = _points(solid, 40_000, seed=4)
    points = points[np.abs(solid.signed_distance(points) - RADIUS) < 0.001][:400]
    assert len(points) > 150
    touched = 0
    for point in points:
        data.qpos[:] = point
        mujoco.mj_forward(model, data)
        distance = float(solid.signed_distance(point)) - RADIUS
        if distance < -tolerance:
            assert data.ncon > 0
        if data.ncon:
            touched += 1
            assert data.contact.dist.min() == pytest.approx(distance, abs=tolerance)
    assert touched > 20


@pytest.mark.parametrize(
    ("said", "name", "size"),
    [
        ("ellipsoid( 1,1, 1.30 )", "ellipsoid(1, 1, 1.3)", np.array([1, 1, 1.3]) * 0.05 / 1.3 ** (1 / 3)),
        ("cube(size=0.04)", "cube(size=0.04)", (0.04, 0.04, 0.04)),
        ("pyramid(size=(0.04, 0.05, 0.06))", "pyramid(size=(0.04, 0.05, 0.06))", (0.04, 0.05, 0.06)),
        ("cuboid(x=2, y=1, z=1, size=0.08)", "cuboid(x=2, y=1, z=1, size=0.08)", (0.08, 0.04, 0.04)),
        ("cube()", "cube", (0.05, 0.05, 0.05)),
        ("capsule()", "capsule", np.array([1, 1, 2]) * 0.05 / 2 ** (1 / 3)),
    ],
)
def test_names_say_proportions_and_size(said, name, size):
    assert shapes.check("shape", said) == name
    np.testing.assert_allclose(shapes.default_size(said), size)
    solid = shapes.make(said)
    assert solid.name == name
    np.testing.assert_allclose(solid.size, size)
    assert shapes.find(said) is shapes.find(name)


@pytest.mark.parametrize("family", shapes.FAMILIES)
def test_every_family_has_the_volume_of_a_cube_to_hold_unless_a_size_is_said(family):
    assert np.prod(shapes.default_size(family)) == pytest.approx(0.05**3)
    assert max(shapes.default_size(f"{family}(size=0.044)")) == pytest.approx(0.044)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("elipsoid(1, 1, 2)", r"unknown shape 'elipsoid.*ellipsoid\(x=1, y=1, z=1\.3\)"),
        ("torus(0.9)", r"torus\(0\.9\).*tube must be"),
        ("torus(tube=0.3, tube=0.2)", "unknown shape"),
        ("torus(hole=0.3)", r"'hole'.*say torus\(tube=0\.3\)"),
        ("prism(2)", "sides must be"),
        ("prism(6.5)", "sides must be"),
        ("cuboid(1, 1, 100)", "within 5 times the mean"),
        ("cuboid(1, -1, 1)", "extent must be"),
        ("ellipsoid(1, 1, nan)", "unknown shape"),
        ("ellipsoid(1, 1, 1e999)", "extent must be"),
        ("ellipsoid(True)", "unknown shape"),
        ("noise(-1)", "seed must be"),
        ("superquadric(0)", "must be"),
        ("capsule(0.5)", "length must be"),
        ("cube(0.04)", "too many positional"),
        ("cube(size=0.0001)", "object size must"),
        ("cube(size=(0.04, 0.04))", "object size must"),
        ("sphere(size=(0.04, 0.04, 0.05))", "three equal extents"),
        ("torus(size=(0.05, 0.05, 0.04))", "below half"),
        ("cube(size=__import__('os'))", "unknown shape"),
        ("cube(*(1, 2))", "unknown shape"),
        ("cube(**{'size': 1})", "unknown shape"),
        ("cube.size(1)", "unknown shape"),
        ("(" * 3000, "unknown shape"),
        ("cube(size=" + "9" * 5000 + ")", "unknown shape"),
        ("cube(\0)", "unknown shape"),
    ],
)
def test_names_that_are_none_are_refused_in_a_line(name, why):
    with pytest.raises(ValueError, match=why) as refused:
        shapes.make(name)
    assert len(str(refused.value)) < 900


def test_noise_is_one_solid_for_each_seed():
    first, again, other = (shapes.FAMILIES["noise"](seed) for seed in (5, 5, 6))
    rays = directions(500)
    np.testing.assert_array_equal(first.radius(rays), again.radius(rays))
    assert np.abs(np.log(first.radius(rays) / other.radius(rays))).max() > 0.1


def test_noise_varies_as_much_as_its_amplitude_says():
    rays = directions(2000)
    spread = [np.std(np.log(shapes.FAMILIES["noise"](seed, 0.1).radius(rays))) for seed in range(40)]
    assert np.sqrt(np.mean(np.square(spread))) == pytest.approx(0.1, rel=0.25)


def test_superquadric_with_exponents_of_one_is_a_ball():
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (500, 3))
    ball = shapes.make("sphere").signed_distance(points)
    np.testing.assert_allclose(shapes.make("superquadric(1, 1)").signed_distance(points), ball, atol=2e-5)


def test_directions_are_even_and_their_triangles_close_the_ball():
    rays, faces = star_shaped.triangulated(1500)
    assert len(faces) == 2 * len(rays) - 4
    assert ConvexHull(rays).volume == pytest.approx(4 / 3 * np.pi, rel=0.01)


@pytest.mark.parametrize("name", ["torus", "noise(2)", "prism(5)"])
def test_shapes_travel_to_other_processes(name):
    solid = shapes.make(name)
    there = pickle.loads(pickle.dumps(solid))
    points = _points(solid, 50, seed=6)
    np.testing.assert_array_equal(there.signed_distance(points), solid.signed_distance(points))


def test_environment_explores_them_and_says_what_they_are():
    names = ("torus(0.4)", "ellipsoid(1,1,1.5)")
    with gym.make("HapticSLAM/TwoFinger-v0", shape=names, reveal_truth=True, size_jitter=0.1) as env:
        seen = set()
        for seed in range(8):
            _, info = env.reset(seed=seed)
            seen.add(info["truth"]["shape"])
            for _ in range(5):
                env.step(np.ones(env.action_space.shape, dtype=np.float32))
        assert seen == {"torus(0.4)", "ellipsoid(1, 1, 1.5)"}
        _, info = env.reset(options={"shape": "cone(2)"})
        assert info["truth"]["shape"] == "cone(2)"
