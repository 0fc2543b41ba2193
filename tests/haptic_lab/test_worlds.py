"""Names of objects, and the candidates for them."""

from __future__ import annotations

import pytest

from haptic_env import hands, shapes
from haptic_env.hand import Hand
from haptic_lab.worlds import as_shape, candidates_of


@pytest.fixture(scope="module")
def two_finger() -> Hand:
    return hands.make("two_finger")


@pytest.mark.parametrize("name", shapes.SHAPES)
def test_a_shape_with_a_size_takes_the_place_of_its_namesake(two_finger: Hand, name: str) -> None:
    like = f"{name}(size=0.04)"
    candidates = candidates_of(two_finger, shapes.SHAPES, like=like)
    assert set(candidates) == {like, *shapes.SHAPES} - {name}


@pytest.mark.parametrize("like", ["torus(0.4)", "ellipsoid", "noise(7)"])
def test_a_shape_of_a_family_stands_beside_all(two_finger: Hand, like: str) -> None:
    assert set(candidates_of(two_finger, shapes.SHAPES, like=like)) == {like, *shapes.SHAPES}


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("torus( .4 )", "torus(0.4)"),
        ("torus()", "torus"),
        ("prism(3,size=(.04,.04,.06))", "prism(3, size=(0.04, 0.04, 0.06))"),
        ("cube", "cube"),
        ("a (1).stl", "a (1).stl"),
        ("torus(", "torus("),
    ],
)
def test_a_shape_has_one_name_however_it_is_typed(typed: str, name: str) -> None:
    assert as_shape(typed) == name
