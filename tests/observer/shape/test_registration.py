"""Solids are moved to where they explain touches."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from haptic_env import shapes
from observer.shape.distance_fields import Solids, solids_of
from observer.shape.registration import UNKNOWNS, Ranges, Touched, register

STARTS = 96
TOLERANCE = 0.001
WIDE = Ranges((0.8, 1.2), np.full(3, -0.02), np.full(3, 0.02), True)


def _touched(name: str, turn: Rotation, place: np.ndarray, size: float, surprise: float = 0.0) -> Touched:
    """Points on the surface of a solid, and balls that touch it from outside, all about."""
    shape = shapes.make(name, size * shapes.default_size(name))
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (300, 3)) * shape.size
    for _ in range(30):
        points = points - shape.signed_distance(points)[:, None] * _normal(shape, points)
    points = points[np.abs(shape.signed_distance(points)) < 2e-4]
    balls = points + 0.008 * _normal(shape, points)
    radius = shape.signed_distance(balls)
    return _told(turn.apply(points) + place, turn.apply(balls) + place, radius, surprise)


def _told(points: np.ndarray, balls: np.ndarray, radius: np.ndarray, surprise: float = 0.0) -> Touched:
    """Each point a patch of its own and each ball a look, with gaps known to a millimetre."""
    patches, looks = (np.arange(len(each) + 1) for each in (points, balls))
    slack = np.full(len(balls), TOLERANCE)
    around = np.concatenate([balls, radius[:, None]], axis=1)
    touches = np.ones(len(points)), np.full(len(points), TOLERANCE)
    silence = np.ones(len(balls)), slack, slack  # as deep as one tolerance each: they touch
    return Touched(points, patches, *touches, balls, radius, looks, around, *silence, surprise)


def _normal(shape: shapes.Solid, points: np.ndarray) -> np.ndarray:
    step = 1e-5 * np.eye(3)
    slope = np.stack([shape.signed_distance(points + h) - shape.signed_distance(points - h) for h in step], axis=1)
    return slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-12)


def _starts(name: str, ranges: Ranges) -> Solids:
    solids = solids_of([shapes.make(name)] * STARTS, 0.03)
    rng = np.random.default_rng(1)
    solids.position[:] = rng.uniform(ranges.low, ranges.high, (STARTS, 3))
    if ranges.turns:
        solids.rotation[:] = Rotation.random(STARTS, rng=rng).as_matrix()
    return solids


def _registered(solids: Solids, touched: Touched, ranges: Ranges) -> tuple[np.ndarray, np.ndarray]:
    cost, information = np.empty(STARTS), np.empty((STARTS, UNKNOWNS, UNKNOWNS))
    register(solids, touched, ranges, 12, cost, information)
    return cost, information


@pytest.mark.parametrize("name", ["cube", "torus(0.4)", "L", "noise(1)"])
def test_size_place_and_turn_are_found(name):
    turn, place, size = Rotation.from_rotvec([0.5, -1.0, 0.3]), np.array([0.012, -0.009, 0.004]), 1.12
    touched = _touched(name, turn, place, size)
    solids = _starts(name, WIDE)
    cost, information = _registered(solids, touched, WIDE)
    best = int(np.argmin(cost))
    np.testing.assert_allclose(solids.scale[best], size, rtol=0.01)
    np.testing.assert_allclose(solids.position[best], place, atol=1e-3)
    there = shapes.make(name, solids.scale[best] * shapes.default_size(name))
    off = there.signed_distance((touched.points - solids.position[best]) @ solids.rotation[best])
    assert np.sqrt(np.mean(off**2)) < 5e-4
    np.testing.assert_allclose(information[best], information[best].T)
    assert np.linalg.eigvalsh(information[best]).min() > -1e-6 * information[best].max()


@pytest.mark.parametrize("name", ["cube", "noise(1)"])
def test_what_the_likelihood_says_is_made_least(name):
    """From near the truth: no place, size or turn near to what is found explains more."""
    turn, place, size = Rotation.from_rotvec([0.5, -1.0, 0.3]), np.array([0.012, -0.009, 0.004]), 1.12
    touched = _touched(name, turn, place, size, surprise=0.001)
    solids, rng = _starts(name, WIDE), np.random.default_rng(2)
    solids.position[:] = place + 0.001 * rng.standard_normal((STARTS, 3))
    solids.rotation[:] = (Rotation.from_rotvec(0.05 * rng.standard_normal((STARTS, 3))) * turn).as_matrix()
    solids.scale[:] = size
    before, information = np.empty(STARTS), np.empty((STARTS, UNKNOWNS, UNKNOWNS))
    register(solids, touched, WIDE, 0, before, information)
    cost, _ = _registered(solids, touched, WIDE)
    assert (cost <= before).all()
    best = int(np.argmin(cost))
    assert cost[best] < 0.5 * np.median(before)
    scale, position, rotation = solids.scale[best], solids.position[best].copy(), solids.rotation[best].copy()
    solids.scale[:] = scale * np.exp(0.003 * rng.standard_normal(STARTS))
    solids.position[:] = position + 2e-4 * rng.standard_normal((STARTS, 3))
    solids.rotation[:] = Rotation.from_rotvec(0.005 * rng.standard_normal((STARTS, 3))).as_matrix() @ rotation
    register(solids, touched, WIDE, 0, before, information)
    assert before.min() > 0.995 * cost[best]


@pytest.mark.parametrize(
    "ranges",
    [
        WIDE._replace(scale=(1.0, 1.0)),
        WIDE._replace(low=np.zeros(3), high=np.zeros(3)),
        WIDE._replace(turns=False),
    ],
    ids=["size", "place", "turn"],
)
def test_what_is_known_stays(ranges):
    touched = _touched("cube", Rotation.from_rotvec([0.2, 0.1, 0.0]), np.array([0.01, 0.0, 0.0]), 1.1)
    solids = _starts("cube", ranges)
    before = solids.scale.copy(), solids.position.copy(), solids.rotation.copy()
    _registered(solids, touched, ranges)
    changed = [
        not np.array_equal(a, b) for a, b in zip(before, (solids.scale, solids.position, solids.rotation), strict=True)
    ]
    assert changed == [
        ranges.scale[0] < ranges.scale[1], bool((ranges.low < ranges.high).any()), ranges.turns
    ]  # fmt: skip
    assert (solids.scale >= ranges.scale[0]).all()
    assert (solids.scale <= ranges.scale[1]).all()
    assert (solids.position >= ranges.low).all()
    assert (solids.position <= ranges.high).all()


def test_no_touch_moves_nothing_that_lies_outside():
    """Nor is there a division by anything that is not there."""
    nothing = _told(np.empty((0, 3)), np.full((1, 3), 0.5), np.full(1, 0.01))
    solids = _starts("sphere", WIDE)
    before = solids.position.copy()
    cost, _ = _registered(solids, nothing, WIDE)
    np.testing.assert_array_equal(cost, 0.0)
    np.testing.assert_array_equal(solids.position, before)


@pytest.mark.parametrize(("patches", "looks"), [(5, 3), (1000, 1000)])
def test_a_glance_is_a_part_of_what_was_felt(patches, looks):
    touched = _touched("cube", Rotation.identity(), np.zeros(3), 1.0)
    glance = touched.sparse(patches, looks)
    assert len(glance.weight) == min(patches, len(touched.weight)) == len(glance.begin) - 1
    assert len(glance.cost) == min(looks, len(touched.cost)) == len(glance.first) - 1
    for points, of in ((glance.points, touched.points), (glance.balls, touched.balls)):
        assert {tuple(each) for each in points} <= {tuple(each) for each in of}
    cost, information = np.empty(STARTS), np.empty((STARTS, UNKNOWNS, UNKNOWNS))
    register(_starts("cube", WIDE), glance, WIDE, 1, cost, information)
    assert np.isfinite(cost).all()
