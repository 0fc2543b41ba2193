"""Enclosure: the exploratory procedure for global shape (Lederman & Klatzky 1987, Cognitive Psychology 19, 342-368).

"The hand maintains simultaneous contact with as much of the envelope of the object as possible": it is closed about
the object and held, then shifted and closed again; on a wrist that moves it turns around the object, too. Shapes: J
joints, F fingers.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.finger_kinematics import FingerKinematics
from agents.policy import Guided, State
from agents.wrist_motion import WristMotion
from haptic_env import hand_env, validate

STILL = 0.5  # rad/s: a hand whose fastest joint is believed to be slower has come to rest
OPENING = 0.15  # of the longest grasp: how long the hand opens before it grasps anew
TURNING = 0.5  # s: how long a hand on a wrist that moves opens at least, while it turns
SIDEWAYS, CURLED = 1.0, 0.5  # how far grasps differ, fractions of the torque limits


class Enclosure(Guided):
    """Closes all fingers about the grasp centre, holds, and closes anew.

    Once the believed pose has come to rest, and after `seconds` at the latest, it opens a little and closes anew, each
    finger drawn across and curled by chance. A wrist that moves turns the open hand about the grasp centre by chance.

    References:
        Lederman & Klatzky 1987, Cognitive Psychology 19, 342-368.
    """

    def __init__(
        self, env: gym.Env[Any, Any], seed: int | None = None, *, grip: float = 0.5, seconds: float = 0.8
    ) -> None:
        """Find the strokes of each finger.

        Args:
            env: with an `ObserverWrapper`.
            seed: of how grasps differ.
            grip: fraction of the torque limits, in (0, 1].
            seconds: s, the longest of one grasp.

        Raises:
            ValueError: for a value out of range, or as `Guided`.
        """
        super().__init__(env, seed)
        self.grip = validate.number("grip", grip, 0.0, 1.0, above=0.0)
        longest = validate.seconds("seconds", seconds)
        self._rate = hand_env(env).control_hz
        self._longest, self._opening = longest * self._rate, OPENING * longest * self._rate
        self._kinematics = FingerKinematics(self.hand)
        self._wrist = WristMotion(self.hand)
        if self._wrist.free:
            self._opening = max(self._opening, TURNING * self._rate)
            self._longest += self._opening
        turned = ((6,),) if self._wrist.free else ()
        self.remembers = ((), (2, self._kinematics.fingers), (self.joints,), *turned)
        self._strokes = self._kinematics.strokes(self.hand.rest_pose, self.hand.grasp_centre)

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """Grasp.

        Args:
            observation: of one environment.
            state: steps since the grasp began, how it is shifted (2, F), the last pose (J,) rad and, where the wrist
                moves, where it is to be (6,) rad.
            deterministic: of no effect.

        Returns:
            Action (J,), and the next state.
        """
        pose = self.belief.joint_angles
        if state is None:
            state = np.array(0), self._shift(), pose, *self._turned()
        step, shift, before, *turned = state
        fastest = np.abs(pose - before).max() * self._rate
        if step >= self._longest or (step >= 0.5 * self._longest and fastest < STILL):
            step, shift, turned = np.array(0), self._shift(), self._turned()
        close, across, curl = self._strokes
        grip = self.grip if step >= self._opening else -self.grip
        torque = self._kinematics.together(grip * close + shift[0, :, None] * across + shift[1, :, None] * curl)
        for goal in turned:
            torque[self._wrist.joints] = self._wrist.torque(goal, pose, (pose - before) * self._rate)
        return torque, (step + 1, shift, pose, *turned)

    def _turned(self) -> list[NDArray[np.float64]]:
        """(6,) rad, to where a wrist that moves turns the hand for the next grasp; nothing where it is fixed."""
        return [self._wrist.goal(self._wrist.draw(self.rng), np.zeros(3))] if self._wrist.free else []

    def _shift(self) -> NDArray[np.float64]:
        """(2, F): how the next grasp differs, across and curled."""
        return self.rng.uniform(-1.0, 1.0, (2, self._kinematics.fingers)) * [[SIDEWAYS], [CURLED]]
