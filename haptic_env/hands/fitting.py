"""Capsules that stand for the geoms of a model.

A capsule stands for itself, and a sphere is one with next to no bone. Anything else is taken for its box, along whose
longest edge a capsule lies, or several side by side where it is flat. Lengths in metres, in the frame of a body.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from haptic_env.arrays import Array
from haptic_env.hands.skeleton import matrix_of

SHORTEST = 1e-3  # m: a bone has a direction
FLAT = 1.5  # times as wide as it is thick: capsules lie side by side
MOST = 8  # of them
GEOM = mujoco.mjtGeom
NAMES = {
    GEOM.mjGEOM_SPHERE: "sphere", GEOM.mjGEOM_CAPSULE: "capsule", GEOM.mjGEOM_ELLIPSOID: "ellipsoid",
    GEOM.mjGEOM_CYLINDER: "cylinder", GEOM.mjGEOM_BOX: "box", GEOM.mjGEOM_MESH: "mesh",
}  # fmt: skip
ROUND = (GEOM.mjGEOM_SPHERE, GEOM.mjGEOM_CAPSULE)


class FittedCapsule(NamedTuple):
    """A capsule of a body.

    Attributes:
        start: (3,) m, centre of a cap.
        end: (3,) m, centre of the other.
        radius: m.
    """

    start: Array
    end: Array
    radius: float

    def distance(self, points: Array) -> Array:
        """Tell how far points are.

        Args:
            points: (M, 3) m.

        Returns:
            (M,) m from its surface, below 0 inside.
        """
        bone = self.end - self.start
        share = np.clip((points - self.start) @ bone / (bone @ bone), 0.0, 1.0)
        return np.linalg.norm(points - self.start - share[:, None] * bone, axis=1) - self.radius


def capsules_of(model: mujoco.MjModel, geom: int) -> list[FittedCapsule]:
    """Find the capsules that stand for a geom.

    Args:
        model: with the geom.
        geom: its index.

    Returns:
        The capsules, in the frame of its body.

    Raises:
        ValueError: for a geom that is no solid: a plane, a height field.
    """
    kind, size = GEOM(model.geom_type[geom]), model.geom_size[geom]
    place, turn = model.geom_pos[geom], matrix_of(model.geom_quat[geom])
    if kind not in NAMES:
        told = kind.name.removeprefix("mjGEOM_").lower()
        raise ValueError(f"geom {geom_name(model, geom)} is a {told}; skin is {', '.join(NAMES.values())}")
    if kind in ROUND:
        half = size[1] if kind == GEOM.mjGEOM_CAPSULE else 0.0
        return [_along(place, turn[:, 2], half, float(size[0]))]
    box, middle = model.geom_aabb[geom, 3:], model.geom_aabb[geom, :3]
    short, width, long = np.argsort(box, kind="stable")
    count = 1 if kind == GEOM.mjGEOM_ELLIPSOID or box[width] <= FLAT * box[short] else _beside(box[width] / box[short])
    if count == 1:
        radius, shifts = 0.5 * (box[width] + box[short]), np.zeros(1)
    else:
        radius = max(box[short], box[width] / count)
        shifts = np.linspace(-1.0, 1.0, count) * (box[width] - radius)
    centre, halves = place + turn @ middle, np.full(count, box[long])
    if kind == GEOM.mjGEOM_CYLINDER and count > 1:  # a disc, whose chords are shorter the farther out they lie
        halves = np.sqrt(box[long] ** 2 - shifts**2)
    return [
        _along(centre + shift * turn[:, width], turn[:, long], half - radius, float(radius))
        for shift, half in zip(shifts, halves, strict=True)
    ]


def misfit(model: mujoco.MjModel, geom: int, capsules: list[FittedCapsule]) -> tuple[float, float]:
    """Tell how well capsules stand for a geom.

    Args:
        model: with the geom.
        geom: its index.
        capsules: that stand for it, in the frame of its body.

    Returns:
        m: how far the capsules stand out of the geom's surface at most, and how far the surface stands out of them.
    """
    gap = np.min([each.distance(surface(model, geom)) for each in capsules], axis=0)
    return max(-float(gap.min()), 0.0), max(float(gap.max()), 0.0)


def geom_name(model: mujoco.MjModel, geom: int) -> str:
    """Tell which geom it is.

    Args:
        model: with the geom.
        geom: its index.

    Returns:
        Its name, or that of its body and its number there.
    """
    name = model.geom(geom).name
    if name:
        return repr(name)
    body = int(model.geom_bodyid[geom])
    return f"{geom - int(model.body_geomadr[body]) + 1} of body {model.body(body).name!r}"


def _beside(ratio: float) -> int:
    return int(np.clip(round(ratio), 2, MOST))


def _along(centre: Array, axis: Array, half: float, radius: float) -> FittedCapsule:
    reach = max(half, 0.5 * SHORTEST) * axis
    return FittedCapsule(centre - reach, centre + reach, radius)


def surface(model: mujoco.MjModel, geom: int) -> Array:
    """Spread points over a geom.

    Args:
        model: with the geom.
        geom: its index.

    Returns:
        (M, 3) m of its surface, in the frame of its body: the vertices of a mesh, else some.
    """
    return model.geom_pos[geom] + _surface(model, geom) @ matrix_of(model.geom_quat[geom]).T


def _surface(model: mujoco.MjModel, geom: int) -> Array:
    """The same in the frame of the geom."""
    kind = GEOM(model.geom_type[geom])
    if kind == GEOM.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        return np.asarray(model.mesh_vert[first : first + model.mesh_vertnum[mesh]], dtype=np.float64)
    steps = np.linspace(-1.0, 1.0, 5)
    cube = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    box, faces = model.geom_aabb[geom, 3:], cube[np.abs(cube).max(axis=1) == 1.0]
    if kind == GEOM.mjGEOM_BOX:
        return faces * box
    if kind == GEOM.mjGEOM_CYLINDER:
        across = np.linalg.norm(cube[:, :2], axis=1, keepdims=True)
        rim = np.concatenate([cube[:, :2] / np.maximum(across, 1e-9), cube[:, 2:]], axis=1)
        ends = cube[(np.abs(cube[:, 2]) == 1.0) & (across[:, 0] <= 1.0)]
        return np.concatenate([rim[across[:, 0] > 0.0], ends]) * box
    ball = faces / np.linalg.norm(faces, axis=1, keepdims=True)
    if kind == GEOM.mjGEOM_CAPSULE:
        return ball * box[0] + [0.0, 0.0, 1.0] * (np.sign(ball[:, 2:]) * (box[2] - box[0]))
    return ball * box
