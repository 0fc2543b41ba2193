"""Maps that were moved are recognised; the distance is the least that brute force finds."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from haptic_env import shapes
from haptic_env.grid import Grid
from observer.classifiers import AlignedNearestNeighbour, NearestNeighbour, aligned

GRID = Grid.around((0, 0, 0), (0.128, 0.128, 0.128), 0.004)


def _map(name: str, rotation: Rotation | None = None, shift=(0.0, 0.0, 0.0)) -> np.ndarray:
    """A shape as it might be known after long exploration: occupied inside, free around it, unknown further out."""
    quaternion = (Rotation.identity() if rotation is None else rotation).as_quat(scalar_first=True)
    gap = shapes.make(name, position=shift, quaternion=quaternion).signed_distance(GRID.centres())
    return np.interp(gap, [-0.004, 0.004, 0.012, 0.02], [0.9, 0.2, 0.2, 0.5])


def _size(map: np.ndarray) -> float:
    return float(np.square(map - 0.5).sum())


def test_the_distance_is_the_least_over_translations():
    """Against all of them one by one; what leaves the grid meets the unknown."""
    rng = np.random.default_rng(0)
    for shape, reach in (((4, 5, 6), 0.5), ((6, 3, 4), 1.0), ((5, 5, 5), 0.0)):
        one, other = rng.random((2, *shape))
        model = AlignedNearestNeighbour("none", reach).fit([other], ["only"])
        far = [int(reach * n) for n in shape]
        wide = np.pad(other, [(f, f) for f in far], constant_values=0.5)
        found = []
        for at in itertools.product(*(range(2 * f + 1) for f in far)):
            moved = wide[tuple(slice(a, a + n) for a, n in zip(at, shape, strict=True))]
            lost = _size(other) - _size(moved)
            found.append(np.square(one - moved).sum() + lost)
        np.testing.assert_allclose(model.square_distances(one), min(found), rtol=1e-9)


@pytest.mark.parametrize("name", ["cube", "pyramid"])
def test_a_map_that_was_shifted_and_turned_by_quarters_is_at_no_distance(name):
    original = _map(name)
    model = AlignedNearestNeighbour("yaw").fit([original], [name])
    for turns, shift in itertools.product(range(4), [(0, 0, 0), (3, -2, 1), (-5, 4, 2)]):
        moved = np.roll(np.rot90(original, turns), shift, (0, 1, 2))
        assert model.square_distances(moved)[0] < 1e-6 * _size(original)


@pytest.mark.parametrize(
    ("rotations", "turn"),
    [
        ("yaw", Rotation.from_euler("z", 37, degrees=True)),
        pytest.param("yaw", Rotation.from_euler("z", -112.5, degrees=True), marks=pytest.mark.statistical),
        ("all", Rotation.from_rotvec([0.4, 0.2, -0.3])),
        pytest.param("all", Rotation.from_euler("x", 90, degrees=True), marks=pytest.mark.statistical),
    ],
)
def test_moved_maps_are_nearest_to_their_own(rotations, turn):
    """The nearest is its own, also by angles that are in no grid; a comparison in place is lost."""
    names = list(shapes.SHAPES)
    exemplars = [_map(name) for name in names]
    model = AlignedNearestNeighbour(rotations).fit(exemplars, names)
    in_place = NearestNeighbour("squared").fit(exemplars, names)
    right = []
    for index, name in enumerate(names):
        moved = _map(name, turn, (0.012, -0.01, 0.006))
        square = model.square_distances(moved)
        assert square[index] < 0.2 * _size(moved), "a little of it: voxels are coarse"
        assert np.delete(square, index).min() > 0.25 * _size(moved)
        right.append(in_place.predict(moved) == name)
    assert not all(right)


def test_the_distance_is_that_of_a_comparison_in_place_where_nothing_may_move():
    rng = np.random.default_rng(0)
    maps, probe = rng.random((3, 4, 5, 6)), rng.random((4, 5, 6))
    model = AlignedNearestNeighbour("none", reach=0.0).fit(maps, ["a", "b", "c"])
    np.testing.assert_allclose(model.square_distances(probe), np.square(maps - probe).sum(axis=(1, 2, 3)))


def test_more_freedom_never_puts_maps_further_apart():
    maps = [_map(name) for name in shapes.SHAPES]
    probe = _map("cube", Rotation.from_euler("z", 20, degrees=True), (0.01, 0.0, 0.0))
    distances = [
        AlignedNearestNeighbour(rotations, reach).fit(maps, list(shapes.SHAPES)).square_distances(probe)
        for rotations, reach in (("none", 0.0), ("none", 0.25), ("yaw", 0.25))
    ]
    assert (distances[0] >= distances[1] - 1e-9).all()
    assert (distances[1] >= distances[2] - 1e-9).all()
    assert distances[2][0] < 0.5 * distances[0][0]


def test_the_nearest_exemplar_of_a_label_counts():
    maps = [_map("cube"), _map("sphere"), _map("pyramid")]
    model = AlignedNearestNeighbour("none", bandwidth=10.0).fit(maps, ["a", "b", "a"])
    square = model.square_distances(_map("cylinder"))
    ratio = np.exp(-0.5 * (min(square[0], square[2]) - square[1]) / 10.0**2)
    assert model.predict(_map("sphere", shift=(0.008, 0.0, 0.0))) == "b"
    np.testing.assert_allclose(model.predict_proba(_map("cylinder")), [ratio / (1 + ratio), 1 / (1 + ratio)])


@pytest.mark.parametrize(("rotations", "turns"), [("yaw", 24), ("all", 324)])
def test_it_turns_maps_of_half_the_resolution_once_and_few_whole_ones(rotations, turns, monkeypatch):
    """What it costs: a Fourier transform there and back for each turn that is looked at. Turns are made while it
    learns, but for those of the refinement."""
    made, compared = [], []
    turn, largest = aligned._turn, aligned._Overlap.largest

    def turned(map, rotation):
        made.append(map.shape)
        return turn(map, rotation)

    def looked_at(self, other):
        compared.append(other.shape)
        return largest(self, other)

    monkeypatch.setattr(aligned, "_turn", turned)
    monkeypatch.setattr(aligned._Overlap, "largest", looked_at)
    half = tuple((n + 1) // 2 for n in GRID.shape)
    model = AlignedNearestNeighbour(rotations).fit([_map("cube")], ["cube"])
    assert made == [half] * turns
    for name in ("pyramid", "sphere"):
        made.clear(), compared.clear()
        model.square_distances(_map(name))
        assert compared.count(half) == turns
        assert made == [GRID.shape] * len(made), "halves are turned already"
        assert compared.count(GRID.shape) == len(made) <= 1 + aligned.REFINEMENTS[rotations]
