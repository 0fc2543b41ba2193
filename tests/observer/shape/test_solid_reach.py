"""How far the tables of distances reach: what is too far is refused by the names that the user knows."""

from __future__ import annotations

import re

import numpy as np
import pytest

from haptic_env import grid, shapes
from haptic_env.grid import Grid
from observer import ShapePosterior
from observer.shape import distance_fields
from observer.shape.distance_fields import farthest, solids_of


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables are too large a little sooner, and made in half the time."""
    monkeypatch.setattr(grid, "VOXELS", 190**3)
    monkeypatch.setattr(distance_fields, "NODES", 190)


def _cubes(*sizes: float) -> dict[str, list[shapes.Solid]]:
    return {"cube": [shapes.make("cube", (size,) * 3) for size in sizes]}


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize(
    ("told", "sizes", "samples"),
    [
        ({"size_jitter": 0.5}, (0.05,), 4),
        ({}, (0.3,), 1),
        ({"size_jitter": 0.3}, (0.2, 0.18), 1),
    ],
)
def test_a_tolerance_that_is_too_large_is_refused_and_what_is_valid_works(two_finger, told, sizes, samples):
    with pytest.raises(ValueError, match=r"tolerance must be at most .* m for size_jitter=.*, got 0.05") as error:
        ShapePosterior(two_finger, _cubes(*sizes), tolerance=0.05, samples=samples, **told)
    most = float(re.search(r"at most (\S+) m", str(error.value))[1])
    assert most > 0.01
    ShapePosterior(two_finger, _cubes(*sizes), tolerance=most, samples=samples, variants=1, **told)


def test_candidates_that_differ_too_much_in_size_are_refused(two_finger):
    with pytest.raises(ValueError, match=r"candidates of one shape must differ less in size: .* of 0.01 to 0.2 m"):
        ShapePosterior(two_finger, _cubes(0.2, 0.01))


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("sizes", [(0.05,), (0.3,), (0.1, 0.05)])
def test_tables_reach_as_far_as_is_said_and_no_further(sizes):
    solids = _cubes(*sizes)["cube"]
    most = farthest(solids)
    assert len(solids_of(solids, most).shape) == 1
    with pytest.raises(ValueError, match="too large for the memory"):
        solids_of(solids, most + 0.002)


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_a_field_is_that_of_all_its_nodes_at_once(shape):
    solid = shapes.make(shape)
    made = solids_of([solid], 0.06)
    field = made.field(0)
    nodes = Grid.around((0.0, 0.0, 0.0), np.array(field.shape) * made.resolution, made.resolution)
    assert field.size > 2**16
    np.testing.assert_array_equal(field, solid.signed_distance(nodes.centres()).astype(np.float32))
    np.testing.assert_array_equal(made.low[0], nodes.centres()[0, 0, 0])
