"""The way in which the distance from a solid grows is that of the distance that is looked up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from haptic_env import shapes
from haptic_env.compiled import kernel
from observer.shape.distance_fields import box_of, solids_of
from observer.shape.slopes import gap_from, way_from

STEP = 1e-6  # m: within a cell of the table


@kernel()
def _asked(solids, points, gap, way):
    box = box_of(solids, solids.drawn_in[0])
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        gap[n] = gap_from(solids, 0, box, x, y, z)
        way[n, 0], way[n, 1], way[n, 2] = way_from(solids, 0, box, x, y, z)


def _from(solids, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    gap, way = np.empty(len(points)), np.empty((len(points), 3))
    _asked(solids, points, gap, way)
    return gap, way


@pytest.mark.parametrize("name", ["cube", "noise(1)"])
def test_the_way_is_that_of_differences(name):
    turn = np.roll(Rotation.from_rotvec([0.3, -0.8, 0.5]).as_quat(), 1)
    solids = solids_of([shapes.make(name, position=(0.02, -0.01, 0.03), quaternion=turn)], 0.03)
    points = solids.position[0] + np.random.default_rng(0).uniform(-0.035, 0.035, (200, 3))
    points = points[_from(solids, points)[0] < solids.far - 0.001]
    _, way = _from(solids, points)
    slope = np.stack([_from(solids, points + h)[0] - _from(solids, points - h)[0] for h in STEP * np.eye(3)], axis=1)
    slope /= np.linalg.norm(slope, axis=1, keepdims=True)
    alike = (slope * way).sum(axis=1)
    assert np.quantile(alike, 0.02) > 1 - 1e-5  # all but those beside another cell


def test_far_off_it_is_the_way_from_the_middle():
    solids = solids_of([shapes.make("cube")], 0.03)
    point = np.array([[0.3, -0.1, 0.2]])
    gap, way = _from(solids, point)
    np.testing.assert_allclose(gap, solids.far)
    np.testing.assert_allclose(way, point / np.linalg.norm(point))
