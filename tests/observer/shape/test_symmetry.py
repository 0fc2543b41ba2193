"""By which turns a solid looks the same is read off its distances."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from haptic_env import shapes
from haptic_env.shapes.base import Solid
from observer.shape.distance_fields import solids_of
from observer.shape.symmetry import MOST, symmetries
from observer.surface import Surface
from observer.surface.felt_shape import FeltShape


@pytest.mark.parametrize(
    ("name", "count"),
    [("cube", 24), ("cuboid(1, 1, 2)", 8), ("cuboid(1, 2, 3)", 4), ("pyramid", 4), ("prism(6)", 12), ("noise(1)", 1)],
)
def test_as_many_turns_as_the_group_has(name, count):
    turns = symmetries(solids_of([shapes.make(name)], 0.03), 0)
    assert len(turns) == count
    np.testing.assert_allclose(Rotation.from_quat(turns[0]).magnitude(), 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["cube", "cylinder", "torus(0.4)", "L", "cone(1)"])
def test_distances_are_the_same_after_each(name):
    shape = shapes.make(name)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 3)) * shape.size
    turns = Rotation.from_quat(symmetries(solids_of([shape], 0.03), 0))
    assert 1 < len(turns) <= MOST
    for turn in turns:
        np.testing.assert_allclose(shape.signed_distance(turn.apply(points)), shape.signed_distance(points), atol=1e-6)


def test_what_has_no_surface_near_looks_the_same_unturned_alone():
    solids = solids_of([shapes.make("cube")], 0.03)
    (turn,) = symmetries(solids._replace(nodes=solids.nodes + 1.0), 0)
    np.testing.assert_allclose(Rotation.from_quat(turn).magnitude(), 0.0, atol=1e-9)


def test_what_was_felt_unevenly_does_not_look_the_same_from_elsewhere():
    """A cube of which one half is known badly has no turn by which it says the same."""
    pytest.importorskip("igl")
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.box((0.05, 0.05, 0.05)).subdivide().subdivide()
    std = np.where(mesh.vertices[:, 2] > 0.0, 0.01, 0.001)
    felt = FeltShape(Surface(np.array(mesh.vertices), np.array(mesh.faces), std))
    solid = Solid("felt", felt, felt.default_size, (0.0, 0.0, 0.0))
    (turn,) = symmetries(solids_of([solid], 0.03), 0)
    np.testing.assert_array_equal(turn, [0.0, 0.0, 0.0, 1.0])
