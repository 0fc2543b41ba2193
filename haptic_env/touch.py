"""From MuJoCo's contact points to the patches that feel them.

Shapes: C contact points, L links, P patches, B bodies, G geoms. Metres, world frame.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numba import types
from numpy.typing import NDArray

from haptic_env.compiled import inner
from haptic_env.hand import Hand
from haptic_env.patches import PatchLayout, patch_at


class Touch:
    """Which patches of `hand` touch the object in one simulation; the views of its memory are taken once."""

    def __init__(self, hand: Hand, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Take the views of a simulation's memory.

        Args:
            hand: with P patches.
            model: of the hand and an object.
            data: of the model.
        """
        self._data = data
        self._layout = hand.patches.layout
        self._patches = len(hand.patches)
        self._frames = data.xpos, data.xmat
        self.bodies = np.array([model.body(link.body).id for link in hand.links])
        self._link_of_geom = np.full(model.ngeom, -1)  # the object's own geom has none
        for index, body in enumerate(self.bodies):
            self._link_of_geom[model.geom_bodyid == body] = index

    def feel(self) -> NDArray[np.bool_]:
        """Ask which patches a contact point with the object falls into.

        Returns:
            (P,).
        """
        touched = np.zeros(self._patches, dtype=bool)
        if self._data.ncon:
            contact = self._data.contact
            _touch(
                contact.geom,
                contact.dist,
                contact.pos,
                self._link_of_geom,
                self.bodies,
                *self._frames,
                self._layout,
                touched,
            )
        return touched


_ANY = {n: types.Array(of, n, "A") for of, n in ((types.float64, 1), (types.float64, 2))}
_INDEX = types.Array(types.int64, 1, "C")
_FLAGS = types.Array(types.boolean, 1, "C")
_LAYOUT = types.NamedTuple(
    (
        _INDEX,
        types.Array(types.float64, 1, "C"),
        _FLAGS,
        types.int64,
        types.int64,
        types.int64,
        _INDEX,
        _INDEX,
        types.Array(types.int64, 2, "C"),
    ),
    PatchLayout,
)


# With a signature: contact points lie strided in memory but for a single one, which would be compiled for apart.
@inner(
    types.void(
        types.Array(types.int32, 2, "A"),
        _ANY[1],
        _ANY[2],
        _INDEX,
        _INDEX,
        _ANY[2],
        _ANY[2],
        _LAYOUT,
        _FLAGS,
    ),
    error_model="numpy",
)
def _touch(geom, dist, point, link_of_geom, bodies, xpos, xmat, layout, touched):
    """Set `touched` (P,) for the contact points: `geom` (C, 2), `dist` (C,) m, below 0 where they touch, `point`
    (C, 3) m; the frames `xpos` (B, 3) m and `xmat` (B, 9)."""
    for c in range(len(dist)):
        link = max(link_of_geom[geom[c, 0]], link_of_geom[geom[c, 1]])
        if link < 0 or dist[c] >= 0:
            continue
        body = bodies[link]
        dx, dy, dz = point[c, 0] - xpos[body, 0], point[c, 1] - xpos[body, 1], point[c, 2] - xpos[body, 2]
        x = dx * xmat[body, 0] + dy * xmat[body, 3] + dz * xmat[body, 6]
        y = dx * xmat[body, 1] + dy * xmat[body, 4] + dz * xmat[body, 7]
        z = dx * xmat[body, 2] + dy * xmat[body, 5] + dz * xmat[body, 8]
        patch = patch_at(layout, link, x, y, z)
        if patch >= 0:
            touched[patch] = True
