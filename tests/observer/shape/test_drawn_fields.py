"""Fields that take long: how far they are off, where they are kept, and what is done with what was spoilt."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from haptic_env import cache, notice, shapes
from haptic_env.grid import Grid
from haptic_env.shapes.base import Shape, Solid
from observer.shape import drawn_fields
from observer.shape.drawn_fields import FIELD_RESOLUTION, LEVELS, field_of, near_surface

REACH = 0.03


class Told(Shape):
    """A ball that counts what it is asked, and whose distances are kept."""

    def __init__(self, content: str = "ball") -> None:
        self.asked = 0
        self._content = content

    @property
    def content(self) -> str:
        return self._content

    def signed_distance(self, points, size):
        self.asked += points.size // 3
        return np.linalg.norm(points, axis=-1) - size[0] / 2

    def geoms(self, root, size):
        raise NotImplementedError


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    drawn_fields._remembered.cache_clear()
    yield tmp_path / "cache" / "fields"
    drawn_fields._remembered.cache_clear()


@pytest.mark.parametrize("name", [*shapes.SHAPES, "torus", "L", "cone(2)", "cuboid(1, 2, 4)"])
def test_distances_are_exact_near_the_surface_and_little_off_elsewhere(name):
    solid = shapes.make(name)
    grid = Grid.around(np.zeros(3), np.asarray(solid.size) + 0.12, FIELD_RESOLUTION)
    true = solid.signed_distance(grid.centres())
    error = near_surface(solid.shape, solid.size, grid) - true
    near = np.abs(true) < LEVELS[-1][1] - 0.002
    np.testing.assert_allclose(error[near], 0.0, atol=1e-7)
    assert (error != 0).mean() > 0.1
    outside = error[true > 0]
    assert outside.min() > -0.0025
    assert outside.max() < 0.0008
    assert np.sqrt((outside**2).mean()) < 0.0003


def test_few_nodes_are_measured(folder):
    shape = Told()
    grid, distance = field_of(shape, (0.05, 0.05, 0.05), 0.05)
    assert shape.asked < 0.5 * distance.size
    assert grid.shape == distance.shape


def test_a_field_is_found_again_by_what_it_is_of(folder):
    made = field_of(Told(), (0.05, 0.05, 0.05), REACH)
    drawn_fields._remembered.cache_clear()
    again = Told()
    grid, distance = field_of(again, (0.05, 0.05, 0.05), REACH - 0.002)
    assert again.asked == 0
    assert grid == made[0]
    np.testing.assert_array_equal(distance, made[1])
    for shape, size in ((Told("other"), 0.05), (Told(), 0.06)):
        field_of(shape, (size,) * 3, REACH)
        assert shape.asked > 0
    assert len(list(folder.iterdir())) == 3


@pytest.mark.parametrize("spoil", ["cut", "empty", "other", "gone", "pickled"])
def test_a_spoilt_file_is_made_anew(folder, spoil):
    expected = np.array(field_of(Told(), (0.05, 0.05, 0.05), REACH)[1])
    (place,) = folder.iterdir()
    drawn_fields._remembered.cache_clear()
    whole = place.read_bytes()
    if spoil == "cut":
        place.write_bytes(whole[:1000])
    elif spoil == "empty":
        place.write_bytes(b"")
    elif spoil == "other":
        np.save(place, np.zeros((2, 3)))
    elif spoil == "pickled":
        np.save(place, np.array([{}], dtype=object), allow_pickle=True)
    else:
        shutil.rmtree(folder)
    shape = Told()
    np.testing.assert_array_equal(field_of(shape, (0.05, 0.05, 0.05), REACH)[1], expected)
    assert shape.asked > 0
    assert place.read_bytes() == whole


def test_a_folder_that_takes_nothing_costs_the_time_alone(folder, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(drawn_fields.np, "save", full)
    shape = Told()
    _, distance = field_of(shape, (0.05, 0.05, 0.05), REACH)
    assert shape.asked > 0
    assert distance.min() == pytest.approx(-0.025, abs=FIELD_RESOLUTION)
    assert not list(folder.iterdir())


def test_what_is_quick_is_not_kept(folder):
    field_of(shapes.find("cube"), (0.05, 0.05, 0.05), REACH)
    assert not folder.exists()


@pytest.mark.parametrize("name", ["noise(3)", "ellipsoid", "superquadric"])
def test_solids_without_a_closed_form_are_told_apart_by_their_parameters(name):
    shape = shapes.find(name)
    assert shape.content
    contents = {shapes.find(other).content for other in ("noise(4)", "noise(3, 0.2)", "superquadric(1, 0.5)")}
    assert shape.content not in contents
    assert len(contents) == 3


def _solid(shape: Shape, scale: float = 1.0) -> Solid:
    return Solid(shape.content, shape, (0.05 * scale, 0.05 * scale, 0.05 * scale))


def test_how_far_measuring_is_is_told_of_what_is_not_kept(folder):
    heard: list[tuple[int, int]] = []
    field_of(Told(), (0.05, 0.05, 0.05), REACH)
    solids = [_solid(Told()), _solid(Told(""), 0.8), _solid(Told("egg")), _solid(Told("pear"))]
    with notice.heard_by(lambda _, *told: heard.append(told)):
        made = drawn_fields.fields_of(solids, REACH)
        assert heard == [(0, 2), (1, 2), (2, 2)]
        again = drawn_fields.fields_of(solids, REACH)
    assert len(heard) == 3
    for solid, (grid, distance), (_, same) in zip(solids, made, again, strict=True):
        np.testing.assert_array_equal(distance, field_of(solid.shape, solid.size, REACH)[1])
        np.testing.assert_array_equal(distance, same)
        assert grid.shape == distance.shape
