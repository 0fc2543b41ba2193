"""The registry of shapes: add one as a file here and a line in `SHAPES`."""

from __future__ import annotations

from numpy.typing import ArrayLike

from haptic_env import validate
from haptic_env.shapes.base import Shape, Solid
from haptic_env.shapes.cube import Cube
from haptic_env.shapes.cylinder import Cylinder
from haptic_env.shapes.pyramid import Pyramid
from haptic_env.shapes.sphere import Sphere

SHAPES: dict[str, Shape] = {
    "cube": Cube(),
    "sphere": Sphere(),
    "pyramid": Pyramid(),
    "cylinder": Cylinder(),
}

__all__ = ["SHAPES", "Shape", "Solid", "make"]


def make(
    name: str,
    size: ArrayLike | None = None,
    position: ArrayLike = (0.0, 0.0, 0.0),
    quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0),
) -> Solid:
    """The shape `name` as a solid of `size` (3,) m (None: its default) at a world pose (m, wxyz).

    Raises `ValueError` for an unknown name, or a size or pose that is not possible.
    """
    shape = SHAPES[validate.choice("shape", name, SHAPES)]
    extents = shape.check_size(size)
    place = validate.array("object position", position, (3,), "m")
    turn = validate.array("object quaternion", quaternion, (4,))
    length = float((turn @ turn) ** 0.5)
    if length < 1e-6:
        raise ValueError(f"object quaternion (wxyz) must not be zero, got {turn.tolist()}")
    w, x, y, z = (turn / length).tolist()
    return Solid(name, shape, tuple(extents.tolist()), tuple(place.tolist()), (w, x, y, z))
