"""Fingers that are held like claws, so that their tips go ahead, and press lightly.

Shapes: J joints, F fingers. Torques are fractions of the limits, angles in radians.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.finger_kinematics import FingerKinematics
from haptic_env.arrays import Array
from haptic_env.hand import Hand

STIFF, DAMPED, MOST = 2.5, 0.03, 0.8  # by rad and by rad/s, and at most, by which a posture is held


class ClawedFingers:
    """Holds the outer joints and those that move a finger sideways where they are to be; the inner ones press.

    Attributes:
        kinematics: of the fingers.
    """

    def __init__(self, hand: Hand) -> None:
        """Find out which joints do what.

        Args:
            hand: with F fingers.
        """
        self.kinematics = FingerKinematics(hand)
        close, across, _ = self.kinematics.strokes(hand.rest_pose, hand.grasp_centre)
        alone = self.kinematics.alone
        self._across = alone & (np.abs(across) > np.abs(close))
        self._outer = alone & self.kinematics.outer & ~self._across
        self._inner = alone & ~self._outer & ~self._across
        low, high = hand.joint_limits.T
        self._way = np.sign(close)
        self._open, self._shut = np.where(self._way > 0, low, high), np.where(self._way > 0, high, low)
        self._middle, self._half = 0.5 * (low + high), 0.5 * (high - low)
        self._relaxed, self._pull = hand.model.qpos_spring, hand.model.jnt_stiffness / hand.torque_limits

    def closed(self, pose: Array) -> Array:
        """Tell how far fingers are closed.

        Args:
            pose: (J,) rad.

        Returns:
            (F,) from 0, open, to 1, of the joints that press; 0 where there are none.
        """
        share = (pose - self._open) / (self._shut - self._open)
        return np.asarray((share * self._inner).sum(axis=1) / np.maximum(self._inner.sum(axis=1), 1))

    def torque(self, pose: Array, velocities: Array, curl: Array, aside: Array, press: Array) -> NDArray[np.float64]:
        """Tell what holds and presses the fingers, whatever the springs of their joints pull.

        Args:
            pose: (J,) rad, as it is believed to be.
            velocities: (J,) rad/s.
            curl: (F,) of the outer joints' range.
            aside: (F,) of half the range of the sideways ones, in [-1, 1].
            press: (F,) with what the inner joints close, or, negative, open.

        Returns:
            (J,) torques, 0 for joints of no finger alone.
        """
        bent = self._open + curl[:, None] * (self._shut - self._open)
        goal = np.where(self._outer, bent, self._middle + aside[:, None] * self._half)
        held = np.clip(STIFF * (goal - pose) - DAMPED * velocities, -MOST, MOST) * (self._outer | self._across)
        springs = self._pull * (pose - self._relaxed) * (self._outer | self._across | self._inner)
        return np.asarray((held + springs + self._inner * self._way * press[:, None]).sum(axis=0))
