"""What the environment and the observer know of a hand: its tree of joints, its links and its skin.

Shapes: J joints, L links, P patches.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.composer import mjcf
from haptic_env.coupling import Couplings
from haptic_env.patches import Link, Patches
from haptic_env.sliding import compile_model, lever_arms

WIDEST = 100.0  # rad: no joint turns further
USUAL_SIZE = 0.05  # metres: of an object at the grasp centre


def parse(xml: str) -> mjcf.RootElement:
    """Make an editable MJCF tree of `xml`, which dm_control itself may have written with scoped names.

    Args:
        xml: MJCF.

    Returns:
        The root of the tree.
    """
    return mjcf.from_xml_string(xml, escape_separators=True)


@dataclass(frozen=True)
class Hand:
    """A hand in mid-air. Add one as a file and a line in `haptic_env.hands.HANDS`, or as a TOML file.

    Attributes:
        name: as in the registry.
        xml: the MJCF of the hand alone, its base fixed in the world, with one torque motor per joint in the order of
            `joint_names`; slides as `haptic_env.sliding` has them.
        links: (L,) the rigid segments, capsules of skin.
        patches: (P,) the contact patches of the skin.
        rest_pose: (J,) rad, where every episode starts.
        grasp_centre: (3,) m, world frame, where objects are placed.
        workspace: (3,) m, edge lengths of the box about `grasp_centre` that a map covers.
        opening: (3,), the direction in which a large object is moved out of the palm; zero where there is none.
        source: path of the file that describes a hand of one's own; "" for those of the registry.
    """

    name: str
    xml: str
    links: tuple[Link, ...]
    patches: Patches
    rest_pose: NDArray[np.float64]
    grasp_centre: NDArray[np.float64]
    workspace: NDArray[np.float64]
    opening: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    source: str = ""

    def __repr__(self) -> str:
        counts = f"{len(self.rest_pose)} joints, {len(self.links)} links, {len(self.patches)} patches"
        return f"<Hand {self.name}: {counts}{self.source and f', of {self.source}'}>"

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled hand alone: shared and never to be changed; take `copy.copy` to set options."""
        return compile_model(self.xml)

    @cached_property
    def joints(self) -> int:
        """J."""
        return int(self.model.njnt)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names (J,) of the joints, in the order of every (J,) array."""
        return tuple(self.model.joint(j).name for j in range(self.joints))

    @cached_property
    def lever_arms(self) -> NDArray[np.float64]:
        """(J,) m: how far each joint slides in one radian of its angle; 0 for those that turn."""
        return lever_arms(self.model)

    @cached_property
    def couplings(self) -> Couplings:
        """Which joints follow which. A follower's motor is next to none: its root's moves it."""
        return Couplings.of(self.model)

    @cached_property
    def wrist(self) -> NDArray[np.int64]:
        """(6,) the joints by which the hand as a whole moves, three slides and three turns; (0,) where it is fixed. A
        finger may slide along one axis."""
        of = self.model.jnt_bodyid
        slides = np.bincount(of[self.lever_arms > 0.0], minlength=self.model.nbody)
        return np.flatnonzero(slides[of] == 3)

    @cached_property
    def joint_limits(self) -> NDArray[np.float64]:
        """(J, 2) rad: least and largest angle of each joint."""
        return self.model.jnt_range.copy()

    @cached_property
    def torque_limits(self) -> NDArray[np.float64]:
        """(J,) N·m: the torque that an action of 1 commands."""
        return self.model.actuator_gear[:, 0].copy()

    def place(self, size: ArrayLike) -> NDArray[np.float64]:
        """Find where the middle of an upright object belongs.

        The side that faces the palm is as near to it as that of an object of `USUAL_SIZE`.

        Args:
            size: (3,) m, full extents of the object.

        Returns:
            (3,) m, world frame.
        """
        extents = validate.array("object size", size, (3,), "m", bound=validate.FARTHEST)
        beyond = 0.5 * (float(np.abs(self.opening) @ extents) - USUAL_SIZE)
        return self.grasp_centre + max(beyond, 0.0) * self.opening

    @cached_property
    def link_bodies(self) -> NDArray[np.int64]:
        """(L,) index of each link's body in `model`."""
        return np.array([self.model.body(link.body).id for link in self.links])

    def at_rest(self) -> mujoco.MjData:
        """Simulate the hand alone as an episode starts.

        Returns:
            A new simulation of `model`, of which the kinematics are computed.
        """
        data = mujoco.MjData(self.model)
        data.qpos[:] = self.rest_pose
        mujoco.mj_kinematics(self.model, data)
        return data

    def link_ends(self, data: mujoco.MjData) -> NDArray[np.float64]:
        """Find where links end.

        Args:
            data: of `model`, the kinematics computed.

        Returns:
            (L, 3) m in the world, the distal ends of their bones.
        """
        bodies = self.link_bodies
        return self.bones(data.xpos[bodies], data.xmat[bodies].reshape(-1, 3, 3))[:, 1]

    def bones(self, position: NDArray[np.float64], rotation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Find where bones begin and end.

        Args:
            position: (..., L, 3) m, of the frames of links, from wherever it is told.
            rotation: (..., L, 3, 3), of the same.

        Returns:
            (..., L, 2, 3) m, the proximal and the distal end of each.
        """
        length = np.array([link.length for link in self.links])
        return np.stack([position, position + length[:, None] * rotation[..., 2]], axis=-2)

    @cached_property
    def moves(self) -> NDArray[np.bool_]:
        """(L, J): whether each joint moves each link."""
        result = np.zeros((len(self.links), self.joints), dtype=bool)
        for link, body in enumerate(self.link_bodies):
            while body > 0:
                first = self.model.body_jntadr[body]
                result[link, first : first + self.model.body_jntnum[body]] = True
                body = self.model.body_parentid[body]
        return result

    @cached_property
    def joint_group(self) -> NDArray[np.int64]:
        """(J,) numbers of the hand's parts, each a finger or what several fingers hang from: joints are of one part
        that move the same fingers. A finger is a chain of joints that is no part of a longer one."""
        chains = np.unique(self.moves, axis=0)
        longest = [not any((each <= other).all() and (each < other).any() for other in chains) for each in chains]
        parts: dict[bytes, int] = {}
        return np.array([parts.setdefault(of.tobytes(), len(parts)) for of in chains[longest].T])

    @cached_property
    def link_group(self) -> NDArray[np.int64]:
        """(L,) the part that each link belongs to, in the numbering of `joint_group`: that of its own last joint. What
        no joint moves is a part of its own."""
        fixed = self.joint_group.max() + 1
        return np.array([self.joint_group[of][-1] if of.any() else fixed for of in self.moves])

    @cached_property
    def stopped_by(self) -> NDArray[np.bool_]:
        """(L, J): whether a contact at each link may stop each joint: those of its part, and of all that it hangs
        from, and those that are coupled to any of these."""
        same = self.joint_group[:, None] == self.joint_group
        return self.moves @ same @ self.couplings.together

    def torques_along(self, path: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
        """Compute what moves the hand along `path` in free air (inverse dynamics).

        Args:
            path: (T, J) rad.
            rate: Hz, of the frames of `path`.

        Returns:
            (T, J) N·m; those of followers are their roots'.

        Raises:
            ValueError: for a path of other joints or of one frame, and angles beyond ± `WIDEST` rad.
        """
        path = validate.numbers("path", path, 2, bound=WIDEST)
        if path.shape[0] < 2 or path.shape[1] != self.joints:
            raise ValueError(f"path must be two frames or more of shape (T, {self.joints}) in rad, got {path.shape}")
        rate = validate.number("rate", rate, 0.01, 1e5, unit="Hz")
        model = copy.copy(self.model)
        disabled = mujoco.mjtDisableBit
        model.opt.disableflags |= disabled.mjDSBL_CONTACT | disabled.mjDSBL_LIMIT | disabled.mjDSBL_EQUALITY
        data = mujoco.MjData(model)
        velocity = np.gradient(path, 1.0 / rate, axis=0)
        acceleration = np.gradient(velocity, 1.0 / rate, axis=0)
        torques = np.empty(path.shape)
        for frame in range(len(path)):
            data.qpos[:], data.qvel[:], data.qacc[:] = path[frame], velocity[frame], acceleration[frame]
            mujoco.mj_inverse(model, data)
            torques[frame] = data.qfrc_inverse
            if self.couplings:  # what joints do by their root's way is the work of its motor
                torques[frame] = torques[frame] @ self.couplings.spread(path[frame])
        return torques
