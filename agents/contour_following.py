"""Contour following: the exploratory procedure for exact shape (Lederman & Klatzky 1987, Cognitive Psychology 19,
342-368).

"The hand maintains contact with a contour of the object … smooth, nonrepetitive": each finger presses lightly, slides
along what it feels, and turns back where the contour ends. Shapes: J joints, F fingers.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.finger_kinematics import FingerKinematics
from agents.policy import Guided, State
from haptic_env import hand_env, validate

LIGHT, HARD = 0.15, 0.9  # how a finger presses, fractions of the torque limits: while it feels contact, and at most
YIELD_SECONDS, PRESS_SECONDS = 1.0, 0.5  # how long it takes from the one to the other
STUCK = 0.3  # rad/s: a finger whose fastest joint is believed to be slower does not slide
CURLED = 0.5  # of the torque across: how strongly a finger slides along its own length
LEAST_SECONDS = 0.2  # on one way
TURN = 0.6  # rad: SD by which the way back differs


class ContourFollowing(Guided):
    """Presses each finger towards the grasp centre, more while it feels nothing and less while it does, and slides it
    along a heading between across and along, which is turned back where contact was lost or the believed pose no
    longer moves, and after `seconds` at the latest."""

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None, *, seconds: float = 0.8) -> None:
        super().__init__(env, seed)
        self._rate = hand_env(env).control_hz
        self._longest = validate.seconds("seconds", seconds) * self._rate
        self._least = min(LEAST_SECONDS * self._rate, self._longest)
        self._harder = (HARD - LIGHT) / (PRESS_SECONDS * self._rate)
        self._softer = (HARD - LIGHT) / (YIELD_SECONDS * self._rate)
        self._kinematics = FingerKinematics(self.hand)
        self.remembers = (*[(self._kinematics.fingers,)] * 4, (self.joints,))
        self._strokes = self._kinematics.strokes(self.hand.rest_pose, self.hand.grasp_centre)

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """As every policy's; `state`: of each finger (F,) how it presses, its heading (rad), steps on it and whether it
        felt contact, and the last pose (J,)."""
        pose = self.belief.joint_angles
        fingers = self._kinematics.fingers
        if state is None:
            heading = self.rng.uniform(0.0, 2.0 * np.pi, fingers)
            state = np.full(fingers, 0.5), heading, np.zeros(fingers), np.zeros(fingers, dtype=bool), pose
        press, heading, steps, touched, before = state
        touches = self._kinematics.touching(self.hand, observation["contacts"])
        fastest = (self._kinematics.alone * np.abs(pose - before)).max(axis=1) * self._rate
        ends = (touched & ~touches) | (fastest < STUCK)
        turned = (steps >= self._longest) | (ends & (steps >= self._least))
        back = np.pi + TURN * self.rng.standard_normal(fingers)
        heading = np.where(turned, heading + back, heading)
        press = np.clip(press + np.where(touches, -self._softer, self._harder), LIGHT, HARD)
        close, across, curl = self._strokes
        slide = np.cos(heading)[:, None] * across + CURLED * np.sin(heading)[:, None] * curl
        torque = self._kinematics.together(press[:, None] * close + slide)
        return torque, (press, heading, np.where(turned, 0, steps + 1), touches, pose)
