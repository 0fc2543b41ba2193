"""What the physics can touch of a shape, against what the shape is: concave ones are convex pieces there.

Shapes: M places, G geoms. Lengths in metres, in the shape's frame.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.composer import mjcf
from haptic_env.shapes.base import Shape

LINES, PLACES = 3000, 4000  # random lines that may meet the surface, and places that may be inside
PROBE, FAR = 1e-6, 1.0  # m: radius of what tells inside from outside, and what is farther off is nowhere near
BACK, GAP = 5e-4, 1e-5  # m: so far before a line meets the surface it is so free: none slips in between two pieces
AROUND = 0.1  # of its width: how far from the object lines begin


class Fit(NamedTuple):
    """How the physics differs from a shape.

    Attributes:
        pieces: convex ones that physics has.
        off: (M,) m, how far places where random lines meet the physics lie from the shape's surface: above 0 outside.
        size: m³, of the shape.
        volume: of what physics has, over that of the shape.
        astray: volume that only one of both has, over that of the shape.
    """

    pieces: int
    off: Array
    size: float
    volume: float
    astray: float


def fit(shape: Shape, size: Array) -> Fit:
    """Compare what the physics touches with what a shape is.

    Args:
        shape: of any kind; a mesh is cut where it is not yet.
        size: (3,) m, full extents.

    Returns:
        How they differ; places are drawn by a fixed seed.

    Raises:
        ValueError: for a mesh that cannot be cut.
    """
    physics = _Physics(shape, size)
    rng = np.random.default_rng(0)
    width = float(size.max())
    low, high = -0.5 * size - AROUND * width, 0.5 * size + AROUND * width
    start, towards = rng.uniform(low, high, (LINES, 3)), rng.uniform(-0.5 * size, 0.5 * size, (LINES, 3))
    free = ~physics.inside(start)
    way = (towards - start)[free]
    met = physics.met(start[free], way / np.linalg.norm(way, axis=1, keepdims=True))
    places = rng.uniform(-0.52 * size, 0.52 * size, (PLACES, 3))
    there, true = physics.inside(places), shape.signed_distance(places, size) < 0
    whole = max(1, int(true.sum()))
    volume, astray = float(there.sum()) / whole, float((there != true).sum()) / whole
    box = float(np.prod(1.04 * size))
    return Fit(physics.pieces, shape.signed_distance(met, size), box * whole / PLACES, volume, astray)


class _Physics:
    """The geoms of a shape, with a probe."""

    def __init__(self, shape: Shape, size: Array) -> None:
        root = mjcf.RootElement()
        for attributes in shape.geoms(root, size):
            root.worldbody.add("geom", **attributes)
        root.worldbody.add("body", name="probe", mocap=True).add("geom", name="probe", type="sphere", size=[PROBE])
        self._model = mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())
        self._data = mujoco.MjData(self._model)
        self._probe = self._model.geom("probe").id
        self._body = self._model.body("probe").id
        self.pieces = self._model.ngeom - 1
        mujoco.mj_forward(self._model, self._data)

    def inside(self, places: Array, margin: float = -PROBE) -> NDArray[np.bool_]:
        """Which of `places` (M, 3) lie in a piece, or as near to one as `margin` m."""
        model, data = self._model, self._data
        others = [geom for geom in range(model.ngeom) if geom != self._probe]
        result = np.zeros(len(places), dtype=bool)
        for number, place in enumerate(places):
            data.mocap_pos[0] = place
            mujoco.mj_kinematics(model, data)
            result[number] = any(
                mujoco.mj_geomDistance(model, data, geom, self._probe, FAR, None) < margin for geom in others
            )
        return result

    def met(self, start: Array, way: Array) -> Array:
        """Where lines from `start` (M, 3) along `way` (M, 3) first meet the surface; some do not."""
        geom = np.zeros(1, dtype=np.int32)
        far = [
            mujoco.mj_ray(self._model, self._data, place, along, None, 1, self._body, geom)
            for place, along in zip(start, way, strict=True)
        ]
        distance = np.array(far)[:, None]
        meets = distance[:, 0] >= BACK
        found, before = ((start + (distance - back) * way)[meets] for back in (0.0, BACK))
        return np.asarray(found[~self.inside(before, GAP)])
