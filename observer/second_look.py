"""A second look at a trial, told the surface that the first one has felt.

The map in hindsight shares touches anew, but at a path of the hand that was smoothed without knowing the object. By
then there is a surface, drawn from all touches together and thus known better than the skin was at any one of them. So
the trial is gone through once more by an observer for which that surface is the object: a link that begins to touch
lies on it, and no silent one inside (`observer.shape.pose_correction`). So paths are registered to the map that they
have made of scans, too (Lu & Milios 1997, Autonomous Robots 4, 333-349).

What was felt is used twice so: places that many touches tell of are drawn together, a place of which one touch alone
tells stays where it was.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from haptic_env.sensors import Spread
from haptic_env.shapes import triangles
from haptic_env.shapes.base import LARGEST, SMALLEST, Solid
from haptic_env.shapes.pieces import distance_from
from observer.belief import Belief
from observer.fastslam import HapticSLAM
from observer.maps.occupancy import OccupancySnapshot
from observer.shape.misfit import ContactsDoNotFit
from observer.shape.posterior import ShapePosterior
from observer.surface.felt_shape import KNOWN, FeltShape
from observer.surface.mesh import Surface, surface_of
from observer.surface.touches import TouchLog

LEAST_BIAS = 0.01  # degrees: where angles have offsets to find, contact with a solid that is certain tells the pose
TOLERANCE = 0.002  # m, SD of the gap between skin and surface, about, that hands which explore are sure of
UNDECIDED = 2.0 * TOLERANCE  # m, a gap at which a touch is not expected but possible
NEAR = 0.008  # m from the surface, where it counts how well that is known
TAUGHT = "forward_model"  # the motion whose pose contact with a known solid tells for good
SAID = "joint .* was felt at|the filter of the pose was lost"  # by the first look, as it happened
NO_FILE = "a second look needs the whole trial, which no file keeps: save and load a HapticSLAM instead"


class _Known(FeltShape):
    """A surface that was felt, for one trial: taken for certain as far as it is known, and not kept on disk."""

    @property
    def content(self) -> str:
        return ""

    def spread(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> None:
        """Its distance tells of that."""

    def signed_distance(self, points: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        places = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        distance = distance_from(self.surface.vertices, self.surface.faces, places)
        near = np.flatnonzero(np.abs(distance) < NEAR)
        std = self.surface.std[cKDTree(self.surface.vertices).query(places[near])[1]]
        known = np.where(std <= KNOWN, 1.0, TOLERANCE / np.hypot(TOLERANCE, std))
        distance[near] = known * distance[near] + (1.0 - known) * UNDECIDED
        return distance.reshape(np.shape(points)[:-1])


def _can_be_held(surface: Surface) -> bool:
    """Whether it is of a size that an object may have."""
    size = np.ptp(surface.vertices, axis=0)
    return bool((size >= SMALLEST).all() and (size <= LARGEST).all())


class SecondLook(HapticSLAM):
    """`HapticSLAM`, whose last belief of a trial has the map of a second look at it.

    While the trial lasts it is `HapticSLAM` and no more, and so are all beliefs but the last.
    """

    def __init__(
        self,
        hand: Hand,
        sigma_deg: Spread | None = 3.0,
        particles: int = 200,
        *,
        bias_deg: Spread = 0.0,
        **keywords: Any,
    ) -> None:
        """Take the keyword arguments of `HapticSLAM`, but for `solids`.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles; None: it is found out.
            particles: N.
            bias_deg: degrees, SD of the constant error of each joint and trial.
            **keywords: what else `HapticSLAM` is told.

        Raises:
            ValueError: for a value out of range, for what leaves no map in hindsight, and for a motion that contact
                with a solid does not teach.
            ImportError: where the extra `meshes` is missing.
        """
        triangles.check()
        if "solids" in keywords:
            raise ValueError("solids are what a second look finds out itself: tell them to HapticSLAM")
        validate.choice("motion for a second look", keywords.get("motion", TAUGHT), (TAUGHT,))
        super().__init__(hand, sigma_deg, particles, bias_deg=bias_deg, **keywords)
        if not self.in_hindsight:
            raise ValueError("a second look is a map in hindsight: it needs in_hindsight=True and matching='mean'")
        self.needs = (*self.needs, "observer.warming:known_solids")
        self._start: NDArray[np.float64] | None = None
        self._steps: list[tuple[Any, ...]] = []

    def reset(self, seed: int | None = None, joint_angles: ArrayLike | None = None) -> Belief:
        belief = super().reset(seed, joint_angles)
        self._start = None if joint_angles is None else np.array(joint_angles)
        self._steps = []
        return belief

    def step(
        self, torque: ArrayLike | None, joint_angles: ArrayLike, contacts: ArrayLike, root: Pose | None = None
    ) -> Belief:
        belief = super().step(torque, joint_angles, contacts, root)
        heard = (None if each is None else np.array(each) for each in (torque, joint_angles, contacts))
        self._steps.append((*heard, root))
        return belief

    def flush(self) -> list[Belief]:
        """End the trial, and look at it once more, which takes longer than its steps did.

        Returns:
            As `HapticSLAM.flush`, but the last belief has the map of the second look. Its touches are those of the
            first: a surface that were drawn of what was drawn to it would be surer than it is good.

        Raises:
            ValueError: outside a trial.
        """
        touches, occupancy = self._now()
        beliefs = super().flush()
        if beliefs and len(touches):
            snapshot = OccupancySnapshot(lambda: occupancy, beliefs[-1].snapshot.touches)
            beliefs[-1] = replace(beliefs[-1], snapshot=snapshot)
        return beliefs

    def save(self, path: Path | str) -> NoReturn:
        """Refuse, for it would have to keep the whole trial.

        Args:
            path: of no file that is written.

        Raises:
            ValueError: always.
        """
        raise ValueError(NO_FILE)

    @classmethod
    def load(cls, path: Path | str, hand: Hand | None = None, *, solids: ShapePosterior | None = None) -> NoReturn:
        """Refuse, as `save` does.

        Args:
            path: of any file.
            hand: whose it is.
            solids: of the object.

        Raises:
            ValueError: always.
        """
        raise ValueError(NO_FILE)

    def _now(self) -> tuple[TouchLog, Array]:
        """As `HapticSLAM` has it, but the map is that of an observer which goes through the trial anew."""
        touches, occupancy = super()._now()
        surface = surface_of(touches, occupancy, self.grid)
        if surface.empty or not _can_be_held(surface):
            return touches, occupancy
        observer = HapticSLAM(self.hand, **self._told | {"particles": 1} | self._taught(surface))
        observer.reset(0, self._start)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", SAID, RuntimeWarning)
            warnings.simplefilter("ignore", ContactsDoNotFit)  # what was felt is no candidate of a user's
            for step in self._steps:
                observer.step(*step)
        return touches, observer.map_now()

    def _taught(self, surface: Surface) -> dict[str, Any]:
        """What else the other observer is told."""
        shape = _Known(surface)
        x, y, z = (0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))).tolist()
        solid = Solid("what was felt", shape, shape.default_size, (x, y, z))
        told = {
            "solids": ShapePosterior(self.hand, {solid.name: [solid]}, control_hz=self.control_hz),
            "bias_deg": np.maximum(self._told["bias_deg"], LEAST_BIAS),
        }
        if self._told["sigma_deg"] is not None:  # it may have been set since
            told["sigma_deg"] = self.sigma_deg
        return told
