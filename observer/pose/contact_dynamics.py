"""What felt contacts do to the motion of a hand that sees no object: unknown forces, and skin that stands still.

Shapes: J joints, D numbers of the filter's state (`observer.pose.kalman`), P patches, F of them in contact now or a
step ago.

A patch that feels contact says two things without any map. (1) A force acts there: unknown in size, mostly along the
skin's normal; it enters as process noise through the contact Jacobian, J_cᵀ f, not as noise of every joint. Where the
felt angles have offsets it matters that forces last: what presses for a while would be taken for an offset. (2) The
skin there does not move into the object, which stands still: its velocity is near zero along the normal and, with
friction, along the surface. Both are linear. What is normal is as vague as the patch is round.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env import readable, validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.patches import Patches
from observer.kinematics import tree_of
from observer.pose.contact_forces import PatchForces, contact_effects
from observer.pose.kalman_updates import Measurement

SKIN_SPACING = 0.001  # metres
UNFELT = 0.25  # times the usual force, what may press where it would not be felt: mostly nothing does
UNSEEN = 0.5  # of its motor's torque, SD of that of contact where nothing is felt, at each joint that it may stop
MANY = 256  # patches in contact: with more, what they say of the joints' speeds is put together first


@dataclass(frozen=True)
class ContactDynamics:
    """How strongly contact acts on the motion.

    Attributes:
        constrained: contact acts at the patch that feels it; otherwise every joint of a finger in contact gets process
            noise of `joint_speed`, and nothing else here counts.
        normal_force: N, SD of the unknown force of one step along the skin's normal.
        tangential_force: N, likewise along the surface.
        normal_speed: m/s, SD of the skin's velocity about zero along its normal.
        tangential_speed: m/s, likewise along the surface.
        joint_speed: rad/s, SD of what a step adds to the speed of a joint.
        pressing: N, what presses against the patches of a link on average.
        lasting: times as much as the force of one step is the SD of a part that lasts; 0: there is none.
        seconds: s, time constant with which that part fades.

    Raises:
        ValueError: for a value out of range.
    """

    constrained: bool = True
    normal_force: float = 0.7
    tangential_force: float = 0.3
    normal_speed: float = 0.02
    tangential_speed: float = 0.05
    joint_speed: float = 15.0
    pressing: float = 0.0
    lasting: float = 0.0
    seconds: float = 0.1

    __repr__ = readable.line

    def __post_init__(self) -> None:
        validate.boolean("constrained", self.constrained)
        for name in ("normal_force", "tangential_force", "joint_speed", "pressing", "lasting"):
            object.__setattr__(self, name, validate.number(name, getattr(self, name), 0.0, 1e3))
        for name in ("normal_speed", "tangential_speed"):
            object.__setattr__(self, name, validate.number(name, getattr(self, name), 1e-6, 1e3, unit="m/s"))
        object.__setattr__(self, "seconds", validate.seconds("seconds", self.seconds))


WITH_OFFSETS = ContactDynamics(normal_force=0.5, tangential_force=0.25, pressing=0.5, lasting=2.0)
# A wrist that moves pushes harder than fingers do, and draws the skin over the object.
ON_A_WRIST = ContactDynamics(normal_force=1.5, tangential_force=0.8, normal_speed=0.05, tangential_speed=0.15)


class ContactEffects:
    """What contacts on the skin of one hand do to its motion.

    Attributes:
        lasts: whether forces last, so that a filter has to keep the torques that they exert on the joints.
    """

    def __init__(self, hand: Hand, dynamics: ContactDynamics, control_hz: float) -> None:
        """Find out how round the patches are.

        Args:
            hand: with J joints and P patches.
            dynamics: how strongly contact acts.
            control_hz: Hz, steps a second.
        """
        self._hand = hand
        self._dynamics = dynamics
        self._tree = tree_of(hand)
        self.lasts = dynamics.lasting > 0.0 and dynamics.constrained
        self._fade = np.exp(-1.0 / (control_hz * dynamics.seconds))
        self._lasting = dynamics.lasting * np.sqrt(1.0 - self._fade**2) if self.lasts else 0.0
        axes, share, self._outward = _normals(hand.patches)
        force = np.sqrt(dynamics.normal_force**2 * share + dynamics.tangential_force**2 * (1 - share))
        self._speeds = np.sqrt(dynamics.normal_speed**2 * share + dynamics.tangential_speed**2 * (1 - share))
        stopped = hand.stopped_by[hand.patches.numb].any(axis=0)
        self._unseen = np.where(stopped, UNSEEN * hand.torque_limits, 0.0)  # N·m
        self._forces = PatchForces(hand.link_bodies[hand.patches.link], hand.patches.position, axes, force)

    @property
    def usual(self) -> tuple[PatchForces, Array] | None:
        """Forces and speeds (P, 3) m/s of the skin in contact, where there is nothing else; None: there is."""
        how = self._dynamics
        alone = how.constrained and how.pressing == 0.0 and not self.lasts and not self._unseen.any()
        return (self._forces, self._speeds) if alone else None

    def kept(self, felt: NDArray[np.int64]) -> Array:
        """Tell what a step leaves of the torques of forces that last: they end with the contact of a finger.

        Args:
            felt: (F,) the patches in contact.

        Returns:
            (J,) fractions.
        """
        return np.where(self._stopped(felt), self._fade, 0.0)

    def of_step(
        self,
        angles: Array,
        gain: Array,
        contacts: NDArray[np.bool_],
        felt: NDArray[np.int64],
        unfelt: NDArray[np.bool_],
        noise: Array,
    ) -> tuple[Measurement, Array]:
        """Tell what the contacts of one step do.

        Args:
            angles: (J,) rad, as predicted.
            gain: (2J, J), what a torque of 1 N·m at each joint does to angles and velocities in the step.
            contacts: (P,) those of now.
            felt: (F,) the patches in contact now or a step ago, and others that may be.
            unfelt: (F,) which are the others: they feel nothing, but they may not work.
            noise: (D, D) covariance of what the step adds to the state; that of the forces is added to it.

        Returns:
            The velocities of the skin, which are near zero, as a measurement, and the torques (J,) N·m that forces
            exert on average.
        """
        joints, how = self._hand.joints, self._dynamics
        if self._unseen.any():
            unseen = gain * self._unseen
            noise[: 2 * joints, : 2 * joints] += unseen @ unseen.T
        if not how.constrained:
            index = joints + np.flatnonzero(self._stopped(felt))
            noise[index, index] += how.joint_speed**2
        if felt.size == 0 or not how.constrained:
            return Measurement.nothing(joints), np.zeros(joints)
        along = np.empty((felt.size, 3, joints))
        forces = self._forces
        if unfelt.any():
            force = forces.force.copy()
            force[felt[unfelt]] *= UNFELT
            forces = forces._replace(force=force)
        contact_effects(self._tree, angles, gain, forces, self._lasting, felt, noise, along)
        still = contacts[felt]
        speeds, sd = along[still].reshape(-1, joints), self._speeds[felt[still]].ravel()
        if np.count_nonzero(still) > MANY:
            # As many as there are joints say the same: rows of unit variance with the same sum of squares.
            speeds = np.asarray(np.linalg.qr(speeds / sd[:, None], mode="r"))
            sd = np.ones(len(speeds))
        rows = np.zeros((len(speeds), 2 * joints))
        rows[:, joints:] = speeds
        return Measurement(rows, np.zeros(len(rows)), sd**2), self._push(along[~unfelt, 2], felt[~unfelt], contacts)

    def _stopped(self, felt: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(J,) the joints that contact at the patches `felt` (F,) may stop."""
        return np.asarray(self._hand.stopped_by[self._hand.patches.link[felt]].any(axis=0))

    def _push(self, outward: Array, felt: NDArray[np.int64], contacts: NDArray[np.bool_]) -> Array:
        """Torques (J,) N·m by what presses, on average, against the skin of `felt`, which joints move by `outward`."""
        if self._dynamics.pressing == 0.0:
            return np.zeros(self._hand.joints)
        link = self._hand.patches.link[felt]
        shared = self._outward[felt] / np.bincount(link)[link]
        during = np.where(contacts[felt], 1.0, 0.5)  # a touch that has just ended has pressed for half of the step
        return -self._dynamics.pressing * (shared * during) @ outward


class _Normals(NamedTuple):
    """How the skin's normal is spread over each patch.

    Attributes:
        axes: (P, 3, 3) principal axes, rows in the link's frame.
        share: (P, 3) mean square of the normal along each: (0, 0, 1) where it is flat, thirds where it is round.
        outward: (P,) mean along the last axis, by which that points outwards or inwards.
    """

    axes: Array
    share: Array
    outward: Array


@lru_cache(maxsize=8)
def _normals(patches: Patches) -> _Normals:
    skin = patches.surface(SKIN_SPACING)
    count = np.bincount(skin.patch, minlength=len(patches))
    moment = np.zeros((len(patches), 3, 3))
    np.add.at(moment, skin.patch, skin.normals[:, :, None] * skin.normals[:, None, :])
    share, axes = np.linalg.eigh(moment / count[:, None, None])
    outward = np.bincount(skin.patch, (skin.normals * axes[skin.patch, :, 2]).sum(axis=1), len(patches)) / count
    return _Normals(np.ascontiguousarray(np.swapaxes(axes, 1, 2)), np.clip(share, 0.0, 1.0), outward)
