"""What the page is told: a line of JSON each for the scene, every moment, map and surface.

Shapes: J joints, L links, P patches, V vertices, F faces, N ghosts, (X, Y, Z) voxels. Metres about the map's middle.
"""

from __future__ import annotations

import base64
import json
import threading
from typing import Any

import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.shapes import Solid, triangles
from haptic_lab.exploration.surface_picture import CERTAINTY, LIMIT
from haptic_lab.style import HAND, MAP, OUTLINE, POSSIBLE, TOUCHING, TRUTH, UNFEELING, colours_of, titles_of
from haptic_lab.view.moment import SURE, UNKNOWN, Moment, NewTouches, Setting
from haptic_lab.view.skin import skin_of
from observer.kinematics import body_frames, link_frames, placed, tree_of
from observer.surface.mesh import surface_of
from observer.surface.metrics import true_mesh
from observer.surface.touches import TouchingLink, TouchLog

GHOSTS = 12
LEAST = 0.08  # probability of a voxel of which the page is told
UNIT = 2e-5  # m, of places in 16 bits
TURN = 1.0 / 32767.0
USUAL_AZIMUTH, BESIDE, ASIDE = -62.0, 105.0, 0.01  # degrees, degrees from the hand, m from the middle of the map
WRITER = json.JSONEncoder(separators=(",", ":"), allow_nan=False)
NAMES = {"uint8": "u8", "int8": "i8", "int16": "i16", "uint16": "u16", "uint32": "u32", "float32": "f32"}


def packed(values: Any, unit: float | None = None) -> dict[str, Any]:
    """Write an array as JSON can have it.

    Args:
        values: of any shape.
        unit: of which 16 bits count the multiples; None: as they are.

    Returns:
        Its bytes in base64, under the name of their kind.
    """
    array = np.asarray(values)
    told: dict[str, Any] = {}
    if unit is not None:
        array = np.rint(array / unit).clip(-32767, 32767).astype(np.int16)
        told["unit"] = unit
    told[NAMES[array.dtype.name]] = base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
    return told


def line(kind: str, **told: Any) -> str:
    """Write a line.

    Args:
        kind: of line.
        **told: what JSON can say.

    Returns:
        The line, without its end.
    """
    return WRITER.encode({"kind": kind, **told})


class Encoder:
    """Writes the lines of one exploration."""

    def __init__(self, setting: Setting) -> None:
        """Prepare for it.

        Args:
            setting: what stays as it is.
        """
        self.setting = setting
        hand = setting.hand
        self._tree, self._centre = tree_of(hand), setting.grid.centre
        # The same ones at all times, so that the cloud moves as the hand does.
        self._draws = np.random.default_rng(0).standard_normal((GHOSTS, hand.joints))
        self._draws -= self._draws.mean(axis=0)
        self._links: list[TouchingLink] = []
        self._touching = threading.Lock()
        self.no_surface: str | None = None
        try:
            triangles.check()
        except ImportError as error:
            self.no_surface = str(error)

    def scene(self) -> str:
        """Tell what stays as it is.

        Returns:
            A line.
        """
        setting, hand = self.setting, self.setting.hand
        tints, titles = colours_of(setting.labels), titles_of(setting.labels)
        return line(
            "scene",
            title=setting.title,
            seconds=setting.seconds,
            particles=setting.particles,
            azimuth=self._azimuth(),
            extent=setting.grid.extent.tolist(),
            resolution=setting.grid.resolution,
            shape=list(setting.grid.shape),
            labels=[titles[each] for each in setting.labels],
            label_colours=[tints[each] for each in setting.labels],
            radii=[link.radius for link in hand.links],
            skin={name: each if isinstance(each, list) else packed(each) for name, each in skin_of(hand).items()},
            colours={
                "hand": HAND,
                "numb": UNFEELING,
                "ghosts": POSSIBLE,
                "touch": TOUCHING,
                "truth": TRUTH,
                "outline": OUTLINE,
                "map": list(MAP),
                "surface": [to_hex(CERTAINTY(at)) for at in (0.0, 0.5, 1.0)],
            },
            no_surface=self.no_surface,
        )

    def truth(self, solid: Solid | None, label: str | None) -> str:
        """Tell the truth.

        Args:
            solid: that is explored; None: nobody knows.
            label: that would be right.

        Returns:
            A line.
        """
        vertices, faces = np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
        if solid is not None and self.no_surface is None:
            vertices, faces = true_mesh(solid)
        labels = self.setting.labels
        return line(
            "truth",
            label=labels.index(label) if label in labels else None,
            values=packed(np.zeros(len(vertices), dtype=np.uint8)),
            **self._mesh(vertices, faces),
        )

    def state(self, moment: Moment) -> str:
        """Tell of a moment what changes with every one.

        Args:
            moment: of the exploration.

        Returns:
            A line.
        """
        tree = placed(self._tree, moment.root)
        places, turns = link_frames(tree, moment.angles)
        contacts = np.zeros(len(self.setting.hand.patches)) if moment.contacts is None else moment.contacts
        truth = moment.truth
        error = None if truth is None else float(np.rad2deg(np.sqrt(np.mean((truth - moment.angles) ** 2))))
        return line(
            "state",
            step=moment.step,
            time=moment.step / self.setting.control_hz,
            places=packed(places - self._centre, UNIT),
            turns=packed(turns, TURN),
            ghosts=packed(self._ends(tree, self._ghosts(moment)), UNIT),
            touched=packed(np.asarray(contacts, dtype=np.uint8)),
            posterior=[round(float(p), 4) for p in moment.posterior],
            n_eff=round(float(moment.n_eff), 1),
            spread=float(np.rad2deg(moment.std).mean()),
            truth=None if truth is None else packed(self._ends(tree, truth[None]), UNIT),
            error=error,
        )

    def map(self, moment: Moment) -> str:
        """Tell of a moment the map.

        Args:
            moment: that has one.

        Returns:
            A line.
        """
        assert moment.occupancy is not None
        flat = moment.occupancy.reshape(-1)
        cells = np.flatnonzero((flat > LEAST * SURE) & (flat != UNKNOWN))
        chances = np.round(flat[cells] * (255.0 / SURE)).astype(np.uint8)
        return line("map", step=moment.step, cells=packed(cells.astype(np.uint32)), chances=packed(chances))

    def touched(self, new: NewTouches) -> bool:
        """Take note of touches, from which surfaces are drawn.

        Args:
            new: since those that were told before.

        Returns:
            Whether there is a surface.
        """
        with self._touching:
            del self._links[new.begin :]
            self._links += new.links()
            return bool(self._links) and self.no_surface is None

    def surface(self, moment: Moment) -> str:
        """Draw the surface of a moment, which takes a while, and tell it.

        Args:
            moment: that has touches.

        Returns:
            A line.
        """
        assert moment.touches is not None
        assert moment.occupancy is not None
        with self._touching:
            log = TouchLog(self.setting.hand.patches, moment.touches.rate, self._links.copy())
        occupancy = np.where(moment.occupancy == UNKNOWN, 0.5, moment.occupancy / SURE)
        found = surface_of(log, occupancy, self.setting.grid)
        values = np.clip(255.0 * 1e3 * found.std / LIMIT, 0.0, 255.0).astype(np.uint8)
        mesh = self._mesh(found.vertices, found.faces)
        return line("surface", step=moment.step, values=packed(values), **mesh)

    def _azimuth(self) -> float:
        """Degrees from which the object is seen beside the hand, not behind it."""
        places, _ = link_frames(self._tree, self.setting.hand.rest_pose)
        x, y = (places.mean(axis=0) - self._centre)[:2]
        if np.hypot(x, y) < ASIDE:
            return USUAL_AZIMUTH
        beside = np.rad2deg(np.arctan2(y, x)) + np.array([-BESIDE, BESIDE])
        off = (beside - USUAL_AZIMUTH + 180.0) % 360.0 - 180.0
        return float(USUAL_AZIMUTH + off[np.argmin(np.abs(off))])

    def _mesh(self, vertices: Array, faces: NDArray[np.int64]) -> dict[str, Any]:
        middled = vertices - self._centre
        return {"vertices": packed(middled, UNIT), "faces": packed(faces.astype(np.uint32))}

    def _ends(self, tree: Any, poses: Array) -> Array:
        """(N, L, 2, 3) m: the ends of the bones in N poses (N, J) rad."""
        bodies = len(tree.parent)
        places, turns = np.empty((len(poses), bodies, 3)), np.empty((len(poses), bodies, 3, 3))
        for pose, place, turn in zip(poses, places, turns, strict=True):
            body_frames(tree, pose, place, turn)
        return self.setting.hand.bones(places[:, tree.link_body] - self._centre, turns[:, tree.link_body])

    def _ghosts(self, moment: Moment) -> Array:
        """(N, J) rad: poses as probable as any."""
        scale = np.sqrt(np.maximum(np.diag(moment.covariance), 1e-12))
        values, vectors = np.linalg.eigh(moment.covariance / np.outer(scale, scale))
        spread = vectors * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(moment.angles + moment.std * (self._draws @ spread.T))


def end(told: str) -> str:
    """Tell that it is over.

    Args:
        told: how it ended.

    Returns:
        A line.
    """
    return line("end", told=told)
