"""Enclosure: the exploratory procedure for global shape (Lederman & Klatzky 1987, Cognitive Psychology 19, 342-368).

"The hand maintains simultaneous contact with as much of the envelope of the object as possible": it is closed about
the object and held, then shifted and closed again. Shapes: J joints, F fingers.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.finger_kinematics import FingerKinematics
from agents.policy import Guided, State
from haptic_env import hand_env, validate

STILL = 0.5  # rad/s: a hand whose fastest joint is believed to be slower has come to rest
OPENING = 0.15  # of the longest grasp: how long the hand opens before it grasps anew
SIDEWAYS, CURLED = 1.0, 0.5  # how far grasps differ, fractions of the torque limits


class Enclosure(Guided):
    """Closes all fingers about the grasp centre with torques of `grip`; once the believed pose has come to rest, and
    after `seconds` at the latest, opens a little and closes anew, each finger drawn across and curled by chance."""

    def __init__(
        self, env: gym.Env[Any, Any], seed: int | None = None, *, grip: float = 0.5, seconds: float = 0.8
    ) -> None:
        super().__init__(env, seed)
        self.grip = validate.number("grip", grip, 0.0, 1.0, above=0.0)
        longest = validate.seconds("seconds", seconds)
        self._rate = hand_env(env).control_hz
        self._longest, self._opening = longest * self._rate, OPENING * longest * self._rate
        self._kinematics = FingerKinematics(self.hand)
        self.remembers = ((), (2, self._kinematics.fingers), (self.joints,))
        self._strokes = self._kinematics.strokes(self.hand.rest_pose, self.hand.grasp_centre)

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """As every policy's; `state`: steps since the grasp began, how it is shifted (2, F) and the last pose (J,)."""
        pose = self.belief.joint_angles
        if state is None:
            state = np.array(0), self._shift(), pose
        step, shift, before = state
        fastest = np.abs(pose - before).max() * self._rate
        if step >= self._longest or (step >= 0.5 * self._longest and fastest < STILL):
            step, shift = np.array(0), self._shift()
        close, across, curl = self._strokes
        grip = self.grip if step >= self._opening else -self.grip
        torque = self._kinematics.together(grip * close + shift[0, :, None] * across + shift[1, :, None] * curl)
        return torque, (step + 1, shift, pose)

    def _shift(self) -> NDArray[np.float64]:
        """(2, F): how the next grasp differs, across and curled."""
        return self.rng.uniform(-1.0, 1.0, (2, self._kinematics.fingers)) * [[SIDEWAYS], [CURLED]]
