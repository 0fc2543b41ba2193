"""Figures of meshes whose error is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from haptic_env import shapes
from observer.surface import Surface
from observer.surface.mesh import EMPTY
from observer.surface.metrics import facets, mesh_score, true_facets

RADIUS = 0.025
BALL = shapes.make("sphere", (2 * RADIUS,) * 3)


def _ball(radius: float = RADIUS, std: float = 0.001, moved: float = 0.0) -> Surface:
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    return Surface(np.array(mesh.vertices) + [moved, 0, 0], np.array(mesh.faces), np.full(len(mesh.vertices), std))


def _top() -> np.ndarray:
    """Places on the upper part of the ball."""
    way = trimesh.creation.icosphere(subdivisions=3).vertices
    return RADIUS * way[way[:, 2] > 0.8]


def test_a_perfect_mesh():
    score = mesh_score(_ball(), BALL, _top())
    assert score.chamfer_felt_mm < 0.05
    assert score.chamfer_mm < 0.05
    assert score.f_score == 1.0
    assert score.iou > 0.98
    assert score.normal_consistency > 0.999
    assert score.band_felt == score.band == 1.0
    assert score.std_felt_mm == pytest.approx(1.0)


@pytest.mark.parametrize("off", [-0.003, 0.002, 0.004])
def test_a_ball_too_large_or_too_small(off):
    score = mesh_score(_ball(RADIUS + off), BALL, _top())
    assert score.chamfer_mm == pytest.approx(1000 * abs(off), rel=0.03)
    assert score.chamfer_felt_mm == pytest.approx(1000 * abs(off), rel=0.03)
    ratio = ((RADIUS + off) / RADIUS) ** 3
    assert score.iou == pytest.approx(min(ratio, 1 / ratio), abs=0.02)
    assert score.f_score == 1.0


@pytest.mark.parametrize(("std", "held"), [(0.0011, 0.0), (0.0013, 1.0)])
def test_the_band_is_of_90_percent(std, held):
    """An error of 2 mm lies beyond 1.645 SD of 1.1 mm, and within 1.645 SD of 1.3 mm."""
    score = mesh_score(_ball(RADIUS + 0.002, std), BALL, _top())
    assert (score.band_felt, score.band) == (held, held)


def test_beyond_5_mm_there_is_no_score():
    assert mesh_score(_ball(RADIUS + 0.006), BALL, _top()).f_score == 0.0


def test_errors_elsewhere_are_no_matter_of_what_was_felt():
    surface = _ball()
    low = surface.vertices[:, 2] < 0
    surface.vertices[low] *= 1.5
    score = mesh_score(surface, BALL, _top())
    assert score.chamfer_felt_mm < 0.05 < 2.0 < score.chamfer_mm


def test_of_nothing_there_are_no_figures():
    assert all(math.isnan(each) for each in mesh_score(EMPTY, BALL, _top()))
    score = mesh_score(_ball(), BALL, np.empty((0, 3)))
    assert math.isnan(score.chamfer_felt_mm)
    assert math.isnan(score.band_felt)
    assert score.f_score == 1.0


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_the_true_surface_is_on_the_solid(shape):
    solid = shapes.make(shape, (0.05, 0.04, 0.06) if shape == "cube" else (0.05, 0.05, 0.05), (0.1, 0.0, -0.2))
    truth = true_facets(solid)
    assert np.abs(solid.signed_distance(truth.middle)).max() < 0.001
    if shape == "cube":
        assert truth.area.sum() == pytest.approx(2 * (0.05 * 0.04 + 0.05 * 0.06 + 0.04 * 0.06), rel=0.02)


def test_facets_face_out():
    surface = _ball()
    assert ((facets(surface.vertices, surface.faces).normal * surface.vertices[surface.faces[:, 0]]).sum(1) > 0).all()


@pytest.mark.parametrize("touched", [np.zeros((3, 2)), np.full((2, 3), np.nan), "here"])
def test_what_is_no_place_is_refused(touched):
    with pytest.raises(ValueError, match="touched must"):
        mesh_score(_ball(), BALL, touched)


def test_what_is_no_surface_is_refused():
    with pytest.raises(ValueError, match=r"surface must be what belief.surface\(\) returns"):
        mesh_score(None, BALL, _top())
