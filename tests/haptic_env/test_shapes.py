"""Every registered shape: its signed distance against brute force, MuJoCo and what is known of it."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial import cKDTree

from haptic_env import scene, shapes
from haptic_env.grid import Grid
from haptic_env.shapes.base import LARGEST, SMALLEST, rotation_matrix

SIZES = {  # one that is not the default, for each
    "cube": (0.04, 0.05, 0.06),
    "sphere": (0.06, 0.06, 0.06),
    "pyramid": (0.06, 0.04, 0.05),
    "cylinder": (0.04, 0.04, 0.06),
}
VOLUMES = {  # of the bounding box that each fills
    "cube": 1.0,
    "sphere": np.pi / 6,
    "pyramid": 1 / 3,
    "cylinder": np.pi / 4,
}
POSE = {"position": (0.01, -0.02, 0.005), "quaternion": (0.8, 0.3, -0.4, 0.2)}


@pytest.fixture(params=[(name, posed) for name in shapes.SHAPES for posed in (False, True)], ids=str)
def solid(request: pytest.FixtureRequest) -> shapes.Solid:
    """Every shape, as it stands and with another size, moved and turned."""
    name, posed = request.param
    return shapes.make(name, SIZES.get(name), **POSE) if posed else shapes.make(name)


def _points(solid: shapes.Solid, count: int, seed: int, spread: float = 0.05) -> np.ndarray:
    return np.asarray(solid.position) + np.random.default_rng(seed).uniform(-spread, spread, (count, 3))


def _surface(solid: shapes.Solid, count: int) -> np.ndarray:
    """Points (count, 3) of the surface, found along rays from the centre by bisection."""
    rays = np.random.default_rng(0).standard_normal((count, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    low, high = np.zeros(count), np.full(count, 0.15)
    for _ in range(28):
        middle = 0.5 * (low + high)
        inside = solid.signed_distance(np.asarray(solid.position) + middle[:, None] * rays) < 0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.asarray(solid.position) + high[:, None] * rays


def test_distance_is_that_to_the_nearest_point_of_the_surface(solid):
    points = _points(solid, 300, seed=1)
    brute, _ = cKDTree(_surface(solid, 40_000)).query(points)
    distance = np.abs(solid.signed_distance(points))
    assert (distance <= brute + 1e-8).all()
    np.testing.assert_allclose(distance, brute, atol=0.0015)


def test_distance_changes_no_faster_than_the_point_moves(solid):
    first, second = _points(solid, 20_000, seed=2), _points(solid, 20_000, seed=3)
    change = np.abs(solid.signed_distance(first) - solid.signed_distance(second))
    assert (change <= np.linalg.norm(first - second, axis=1) + 1e-12).all()


def test_gradient_outside_has_norm_one(solid):
    points = _points(solid, 5_000, seed=4)
    points = points[solid.signed_distance(points) > 0.001]
    step = 1e-6
    ahead, behind = (solid.signed_distance(points[:, None] + sign * step * np.eye(3)) for sign in (1, -1))
    norm = np.linalg.norm((ahead - behind) / (2 * step), axis=-1)
    assert (np.abs(norm - 1) < 1e-4).all()


def test_distance_takes_any_shape_of_array(solid):
    points = _points(solid, 24, seed=5)
    flat = solid.signed_distance(points)
    np.testing.assert_array_equal(solid.signed_distance(points.reshape(2, 3, 4, 3)), flat.reshape(2, 3, 4))
    assert solid.signed_distance(points[0]) == flat[0]


def test_occupancy_fills_the_known_volume_and_the_bounding_box(solid):
    resolution = 0.00125
    grid = Grid.around(solid.position, np.full(3, 0.1), resolution)
    occupied = solid.occupancy(grid)
    assert occupied.shape == grid.shape
    assert occupied.dtype == bool
    if solid.name in VOLUMES:
        expected = VOLUMES[solid.name] * np.prod(solid.size)
        assert occupied.sum() * resolution**3 == pytest.approx(expected, rel=0.01)
    own = (grid.centres()[occupied] - solid.position) @ rotation_matrix(solid.quaternion)
    np.testing.assert_allclose(own.max(axis=0), np.array(solid.size) / 2, atol=0.0035)
    np.testing.assert_allclose(own.min(axis=0), -np.array(solid.size) / 2, atol=0.0035)


def test_rotation_is_that_of_mujoco():
    rng = np.random.default_rng(6)
    for quaternion in rng.standard_normal((20, 4)):
        expected = np.zeros(9)
        mujoco.mju_quat2Mat(expected, quaternion / np.linalg.norm(quaternion))
        np.testing.assert_allclose(rotation_matrix(quaternion), expected.reshape(3, 3), atol=1e-12)


def test_corners_of_a_turned_box_lie_on_its_surface():
    box = shapes.make("cube", SIZES["cube"], **POSE)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners = (signs * np.array(box.size) / 2) @ rotation_matrix(box.quaternion).T + box.position
    np.testing.assert_allclose(box.signed_distance(corners), 0.0, atol=1e-12)
    np.testing.assert_allclose(
        box.signed_distance(2 * corners - box.position), np.linalg.norm(box.size) / 2, atol=1e-12
    )


def test_pyramid_has_its_apex_at_plus_z_and_its_corners_below():
    pyramid = shapes.make("pyramid", (0.06, 0.04, 0.05))
    known = [[0, 0, 0.025], [0.03, 0.02, -0.025], [-0.03, 0.02, -0.025], [0.03, -0.02, -0.025]]
    np.testing.assert_allclose(pyramid.signed_distance(known), 0.0, atol=1e-12)
    assert pyramid.signed_distance([0, 0, 0.030]) == pytest.approx(0.005)
    assert pyramid.signed_distance([0, 0, -0.030]) == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("name", "point", "expected"),
    [
        ("cube", (0.025, 0.0, 0.0), 0.0),
        ("cube", (0.0, 0.0, 0.0), -0.025),
        ("cube", (0.028, 0.029, 0.0), 0.005),
        ("sphere", (0.0, 0.0, 0.0), -0.025),
        ("sphere", (0.03, 0.04, 0.0), 0.025),
        ("cylinder", (0.0, 0.0, 0.035), 0.010),
        ("cylinder", (0.0, 0.020, 0.0), -0.005),
        ("cylinder", (0.028, 0.0, 0.029), 0.005),
        ("pyramid", (0.0, 0.0, -0.030), 0.005),
    ],
)
def test_known_distances(name, point, expected):
    assert shapes.make(name, (0.05, 0.05, 0.05)).signed_distance(point) == pytest.approx(expected, abs=1e-12)


def test_mujoco_sees_the_same_surface(solid, probe):
    """A probe sphere touches exactly when its centre is nearer than its radius, and as deep as the distance says."""
    radius = 0.004
    model = scene.compose(probe, solid)
    data = mujoco.MjData(model)
    scene.place(model, data, solid)
    surface = _surface(solid, 300)
    normal = np.stack(
        [solid.signed_distance(surface + d) - solid.signed_distance(surface - d) for d in 1e-6 * np.eye(3)], axis=1
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tolerance = 5e-5
    for point, outward in zip(surface, normal, strict=True):
        for gap in (-0.0005, -0.0001, 0.0001, 0.0005):
            data.qpos[:] = point + (radius + gap) * outward
            mujoco.mj_forward(model, data)
            distance = float(solid.signed_distance(data.qpos)) - radius
            if distance < -tolerance:
                assert data.ncon > 0
                assert data.contact.dist.min() == pytest.approx(distance, abs=tolerance)
            elif distance > tolerance:
                assert data.ncon == 0


@pytest.mark.parametrize("name", shapes.SHAPES)
@pytest.mark.parametrize(
    "size",
    [(0.05, 0.05), (0.0, 0.05, 0.05), (-0.05,) * 3, (np.nan, 0.05, 0.05), (np.inf,) * 3, "big", (LARGEST * 1.01,) * 3],
    ids=str,
)
def test_impossible_sizes_are_refused(name, size):
    with pytest.raises(ValueError, match="object size must"):
        shapes.make(name, size)


@pytest.mark.parametrize("name", shapes.SHAPES)
def test_default_size_is_that_of_a_thing_to_hold(name):
    solid = shapes.make(name)
    assert all(0.040 <= extent <= 0.060 for extent in solid.size)
    assert shapes.make(name, (SMALLEST,) * 3).size == (SMALLEST,) * 3


def test_round_shapes_refuse_unequal_diameters():
    with pytest.raises(ValueError, match=r"sphere's size is three equal extents .*0\.06"):
        shapes.make("sphere", (0.05, 0.05, 0.06))
    with pytest.raises(ValueError, match=r"cylinder's size is \(diameter, diameter, height\) .*0\.04"):
        shapes.make("cylinder", (0.05, 0.04, 0.05))


def test_unknown_shape_lists_the_known():
    with pytest.raises(
        ValueError, match=r"unknown shape 'cubee' \(did you mean 'cube'\?\); choose from cube, .*sphere"
    ):
        shapes.make("cubee")


@pytest.mark.parametrize("quaternion", [(0, 0, 0, 0), (1, 0, 0), (np.nan, 0, 0, 1)], ids=str)
def test_impossible_turns_are_refused(quaternion):
    with pytest.raises(ValueError, match="object quaternion"):
        shapes.make("cube", quaternion=quaternion)
