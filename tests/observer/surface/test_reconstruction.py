"""What a surface is where the answer is known: solids whose surface was touched all over, or in part."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from haptic_env import shapes
from haptic_env.grid import Grid
from haptic_env.shapes.sphere_points import directions
from observer.surface.gaussian_process import AMPLITUDE, LENGTH, Field, Observations, Sphere
from observer.surface.mesh import drawn
from observer.surface.reconstruction import reconstruct
from observer.surface.touches import TouchedSkin

GRID = Grid.around(np.zeros(3), np.full(3, 0.128), 0.004)
NOTHING = np.full(GRID.shape, 0.5)  # is known of any voxel
RADIUS = 0.008  # m, of the fingertip that touches


def _touched(places: np.ndarray, normals: np.ndarray, std: float = 0.0) -> TouchedSkin:
    """Fingertips that touch at `places` (E, 3) where the solid's normals are `normals`: of each the whole tip."""
    tip = directions(60)
    points, outward = [], []
    for place, normal in zip(places, normals, strict=True):
        skin = np.concatenate([[-normal], tip[tip @ normal < 0.9]])  # one point of it touches
        points.append(place + RADIUS * (normal + skin))
        outward.append(skin)
    begin = np.cumsum([0, *map(len, points)])[:-1]
    count = sum(map(len, points))
    return TouchedSkin(np.concatenate(points), np.concatenate(outward), np.full(count, std**2), begin, 1.0)


def _surface(skin: TouchedSkin, occupancy: np.ndarray = NOTHING):
    return drawn(*reconstruct(skin, occupancy, GRID))


def _ball(radius: float, count: int = 150, cap: float = -1.0, std: float = 0.0) -> TouchedSkin:
    way = directions(count)
    way = way[way[:, 2] >= cap]
    return _touched(radius * way, way, std)


@pytest.mark.parametrize("radius", [0.012, 0.025, 0.04])
def test_a_ball_touched_all_over_is_a_ball(radius):
    surface = _surface(_ball(radius))
    distance = np.linalg.norm(surface.vertices, axis=1)
    assert np.abs(distance - radius).max() < 0.001
    assert surface.std.max() < 0.002


@pytest.mark.parametrize("shape", ["cube", "cylinder"])
def test_a_solid_touched_all_over_is_that_solid(shape):
    solid = shapes.make(shape, (0.05, 0.05, 0.05))
    way = directions(3000)
    low, high = np.zeros(len(way)), np.full(len(way), 0.06)
    for _ in range(40):  # where each ray leaves it
        middle = 0.5 * (low + high)
        inside = solid.signed_distance(way * middle[:, None]) < 0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    places = (way * low[:, None])[::15]
    step = 1e-6 * np.eye(3)
    normals = np.stack([solid.signed_distance(places + e) - solid.signed_distance(places - e) for e in step], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    surface = _surface(_touched(places, normals))
    assert np.abs(solid.signed_distance(surface.vertices)).mean() < 0.001


@pytest.mark.parametrize("std", [0.0, 0.002, 0.005])
def test_a_surface_is_closed_and_faces_out(std):
    surface = _surface(_ball(0.025, count=40, cap=0.2, std=std))
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0


def test_what_was_not_felt_is_not_known():
    """And the further from what was, the less."""
    surface = _surface(_ball(0.025, cap=0.6))
    height = surface.vertices[:, 2] / np.linalg.norm(surface.vertices, axis=1)
    felt, beside, away = (surface.std[each].mean() for each in (height > 0.7, abs(height) < 0.2, height < -0.5))
    assert felt < 0.0015 < 0.002 < beside < away
    assert away > 0.6 * AMPLITUDE


def test_who_is_less_sure_of_the_hand_is_less_sure_of_the_surface():
    sure, unsure = (_surface(_ball(0.025, count=30, std=std)).std.mean() for std in (0.0, 0.006))
    assert unsure > 1.5 * sure


def test_what_was_swept_lies_outside():
    skin = _ball(0.025, cap=0.5)
    swept = NOTHING.copy()
    swept[GRID.centres()[..., 2] < -0.006] = 0.001
    low = [_surface(skin, occupancy).vertices[:, 2].min() for occupancy in (NOTHING, swept)]
    assert low[0] < -0.015
    assert low[1] > -0.01


def test_the_field_meets_exact_conditioning():
    """Against the textbook, with errors in common."""
    rng = np.random.default_rng(0)
    places, values = rng.normal(0, 0.03, (7, 3)), rng.normal(0, 0.005, 7)
    half = rng.normal(0, 0.001, (7, 7))
    observed = Observations(places, values, half @ half.T)
    expected, other = Sphere(np.array([0.01, 0.0, -0.01]), 0.02), rng.normal(0, 0.03, (5, 3))
    field = Field(expected, observed)

    def covariance(a, b):
        scaled = np.linalg.norm(a[:, None] - b, axis=2) / LENGTH
        return AMPLITUDE**2 * (1 + scaled) * np.exp(-scaled)

    gain = covariance(other, places) @ np.linalg.inv(covariance(places, places) + observed.noise)
    mean = expected.distance(other) + gain @ (values - expected.distance(places))
    variance = AMPLITUDE**2 - np.einsum("ij,ij->i", gain, covariance(other, places))
    np.testing.assert_allclose(field.value(other), mean, atol=1e-9)
    np.testing.assert_allclose(field.std(other) ** 2, variance, atol=1e-10)


def test_the_gradient_meets_finite_differences():
    rng = np.random.default_rng(1)
    places = rng.normal(0, 0.03, (7, 3))
    field = Field(Sphere(np.zeros(3), 0.02), Observations(places, rng.normal(0, 0.005, 7), 1e-6 * np.eye(7)))
    other, step = rng.normal(0, 0.03, (5, 3)), 1e-6
    slope = [(field.value(other + step * e) - field.value(other - step * e)) / (2 * step) for e in np.eye(3)]
    np.testing.assert_allclose(field.gradient(other), np.stack(slope, axis=1), atol=1e-5)


@pytest.mark.parametrize("count", [1, 2, 3, 10])
@pytest.mark.parametrize("seed", range(3))
def test_whatever_was_touched_there_is_a_closed_surface(count, seed):
    """Touches that fit no one solid, too."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    surface = _surface(_touched(rng.normal(0, 0.03, (count, 3)), way, 0.001))
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 1e-7
    assert np.isfinite(surface.std).all()
