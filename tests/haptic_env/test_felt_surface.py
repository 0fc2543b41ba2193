"""What the physics touches against what a shape is: against solids whose difference is known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from haptic_env import shapes
from haptic_env.shapes import felt_surface
from haptic_env.shapes.base import Shape
from haptic_env.shapes.felt_surface import fit


class Swollen(Shape):
    """A ball whose physics is a ball of another radius, or of two halves of one."""

    def __init__(self, more: float) -> None:
        self.more = more

    def signed_distance(self, points: Any, size: Any) -> Any:
        return np.linalg.norm(points, axis=-1) - size[0] / 2

    def geoms(self, root: Any, size: Any) -> list[dict[str, Any]]:
        return [{"type": "sphere", "size": [size[0] / 2 + self.more]}]


class Halves(Shape):
    """A box of two boxes that touch, or are some way apart: no line gets in between."""

    def __init__(self, apart: float = 0.0) -> None:
        self.apart = apart

    def signed_distance(self, points: Any, size: Any) -> Any:
        return shapes.SHAPES["cube"].signed_distance(points, size)

    def geoms(self, root: Any, size: Any) -> list[dict[str, Any]]:
        half = size * [0.25, 0.5, 0.5]
        return [{"type": "box", "size": half, "pos": [x * (size[0] / 4 + self.apart / 2), 0, 0]} for x in (-1, 1)]


@pytest.mark.parametrize("more", [-0.003, 0.0, 0.002])
def test_a_ball_that_is_larger_or_smaller_to_the_physics(more: float) -> None:
    found = fit(Swollen(more), np.full(3, 0.05))
    np.testing.assert_allclose(found.off, more, atol=1e-6)
    assert len(found.off) > 500
    ratio = (1 + more / 0.025) ** 3
    assert found.volume == pytest.approx(ratio, abs=0.03)
    assert found.astray == pytest.approx(abs(ratio - 1), abs=0.03)
    assert found.size == pytest.approx(np.pi / 6 * 0.05**3, rel=0.03)


def test_no_place_lies_between_pieces_that_touch() -> None:
    found = fit(Halves(), np.full(3, 0.05))
    assert found.pieces == 2
    np.testing.assert_allclose(found.off, 0.0, atol=1e-6)
    assert found.volume == pytest.approx(1.0)


@pytest.mark.parametrize(("aside", "meets"), [(-4e-6, 0), (0.01, 1)])
def test_a_line_that_slips_in_between_two_pieces_meets_no_surface(aside: float, meets: int) -> None:
    physics = felt_surface._Physics(Halves(apart=1e-5), np.full(3, 0.05))
    start, way = np.array([[aside, 0.0, 0.05]]), np.array([[2.5e-4, 0.0, -1.0]])
    assert len(physics.met(start, way / np.linalg.norm(way))) == meets


@pytest.mark.parametrize(("name", "most"), [("torus", 3e-4), ("noise(4, 0.3)", 9e-4), ("L", 1e-6), ("cone", 3e-4)])
def test_solids_by_name_are_as_near_as_is_said(name: str, most: float) -> None:
    found = fit(shapes.find(name), shapes.default_size(name))
    assert np.abs(found.off).max() < most
    assert found.volume == pytest.approx(1.0, abs=0.03)


def test_a_mesh_whose_hull_is_taken_for_it(tmp_path: Path) -> None:
    trimesh.creation.icosphere(radius=0.03).export(tmp_path / "ball.stl")
    found = fit(shapes.find(str(tmp_path / "ball.stl")), shapes.default_size(str(tmp_path / "ball.stl")))
    assert found.pieces == 1
    assert np.abs(found.off).max() < 1e-6
