"""How a wrist that moves brings the hand to where it is wanted.

Shapes: J joints, W joints of the wrist: six, or none where it is fixed. Lengths in metres, angles in radians, world
frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.kinematics import body_frames, tree_of

STIFF, DAMPED = 5.0, 0.05  # fractions of the torque limits by radian, and by rad/s: soft, so that contact may push it
WITHIN = 0.95  # of the limits: goals beyond are out of reach
FARTHEST_TILT = np.deg2rad(100.0)  # of the hand's axis, from where it is at rest


class WristMotion:
    """Turns a hand as a whole about its grasp centre, and shifts it.

    Attributes:
        joints: (W,) of the wrist.
        axis: (3,), from the wrist to the grasp centre at rest.
    """

    def __init__(self, hand: Hand) -> None:
        """Find where the wrist is.

        Args:
            hand: with J joints.
        """
        self.joints = hand.wrist
        self._centre = hand.grasp_centre
        self._place = _anchor(hand, int(self.joints[-1])) if self.free else self._centre
        self._lever_arm = hand.lever_arms[self.joints[:3]]
        self._reach = WITHIN * np.abs(hand.joint_limits[self.joints]).min(axis=1)
        self._pull = hand.model.jnt_stiffness[self.joints] / hand.torque_limits[self.joints]
        away = self._centre - self._place
        self.axis: Array = away / max(float(np.linalg.norm(away)), 1e-9)

    @property
    def free(self) -> bool:
        """Whether the hand has a wrist that moves."""
        return self.joints.size > 0

    def goal(self, turn: Rotation, shift: Array) -> Array:
        """Find the angles of the wrist that turn the hand, as it is at rest, about the grasp centre and then shift it.

        Args:
            turn: of the hand.
            shift: (3,) m.

        Returns:
            (W,) rad, which may be out of reach.
        """
        if not self.free:
            return np.empty(0)
        way = self._centre + turn.apply(self._place - self._centre) + shift - self._place
        m = turn.as_matrix()  # Rx(roll)·Ry(pitch)·Rz(yaw)
        pitch = np.arcsin(np.clip(m[0, 2], -1.0, 1.0))
        roll, yaw = np.arctan2(-m[1, 2], m[2, 2]), np.arctan2(-m[0, 1], m[0, 0])
        return np.concatenate([way / self._lever_arm, [roll, pitch, yaw]])

    def draw(self, rng: np.random.Generator, farthest_tilt: float = FARTHEST_TILT) -> Rotation:
        """Draw a turn that can be reached, all as probable.

        Args:
            rng: gives the draws.
            farthest_tilt: rad, of the hand's axis from where it is at rest.

        Returns:
            The turn; none where the wrist is fixed.
        """
        while self.free:
            turn = Rotation.from_quat(rng.standard_normal(4))
            if turn.apply(self.axis) @ self.axis >= np.cos(farthest_tilt) and self._reaches(turn):
                return turn
        return Rotation.identity()

    def _reaches(self, turn: Rotation) -> bool:
        return bool((np.abs(self.goal(turn, np.zeros(3))) <= self._reach).all())

    def torque(self, goal: Array, angles: Array, velocities: Array) -> NDArray[np.float32]:
        """Tell what moves the wrist to its goal.

        Args:
            goal: (W,) rad.
            angles: (J,) rad, as they are believed to be.
            velocities: (J,) rad/s.

        Returns:
            (W,) fractions of the torque limits.
        """
        now = angles[self.joints]
        held = self._pull * now  # against the springs
        drive = STIFF * (goal - now) - DAMPED * velocities[self.joints] + held
        return np.clip(drive, -1.0, 1.0).astype(np.float32)


def _anchor(hand: Hand, joint: int) -> Array:
    """(3,) m: about what a joint turns at rest."""
    tree = tree_of(hand)
    position, rotation = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
    body_frames(tree, hand.rest_pose, position, rotation)
    body = int(np.searchsorted(tree.first_joint, joint, side="right")) - 1
    return position[body] + rotation[body] @ tree.anchor[joint]
