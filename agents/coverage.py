"""Coverage: an exploration whose aim is to touch all of an object.

The hand is closed about the object from one side after the other. While it is closed everything moves at once, each at
a pace of its own: the wrist rocks, tilts and shifts, fingers swing across and curl, so that the skin slides over ever
other places (enclosure and lateral motion at once, of Lederman & Klatzky's procedures). From where it grasps next it
chooses by its own record of the directions in which it has felt something.

Shapes: J joints, F fingers, D directions, M places.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from agents.finger_kinematics import FingerKinematics
from agents.policy import Guided, State
from agents.wrist_motion import WristMotion
from haptic_env import hand_env, validate
from haptic_env.arrays import Array
from haptic_env.shapes.sphere_points import directions
from observer.kinematics import placed_points, tree_of

OPENING = 0.2  # s: how long the hand opens, and turns, before it grasps anew
LET_GO = -0.6  # fractions of the torque limits, by which it opens
PACES = (0.8, 2.0)  # Hz, between which everything moves
CLAWED, CURLED = 0.4, 0.8  # of the torques that curl a finger: always, so that its tip goes ahead, and back and forth
ROCKED, TILTED = 0.5, 0.3  # rad: how far the hand turns about its own axis, and about any
SHIFTED, LIFTED = 0.012, 0.035  # m: how far it is shifted while it is closed, and along its axis from grasp to grasp
FARTHEST_GRASP = np.deg2rad(160.0)  # of the hand's axis: all but back to front, where no wrist comes
DIRECTIONS, PLACES = 400, 500  # D, M
CANDIDATES, SAMPLE = 64, 200  # sides that are compared, by how many places
ENOUGH = 12.0  # touches in a direction: it is then known well
FAR = 0.1  # what a side loses by each radian that a joint of the wrist is from it
FIRST = 30  # touches, before which sides are drawn by chance


class Record(NamedTuple):
    """What was touched so far.

    Attributes:
        felt: (D,) touches in each direction from the grasp centre.
        places: (M, 3) m, where the skin was when it touched, in the frame of the hand that is turned to its side.
        touches: how many of these there were; the last M are kept.
    """

    felt: Array
    places: Array
    touches: Array


class Coverage(Guided):
    """Grasps from the sides of which least is known, and slides over all that it reaches there.

    A hand whose wrist is fixed moves its fingers alone.
    """

    def __init__(
        self, env: gym.Env[Any, Any], seed: int | None = None, *, grip: float = 0.6, seconds: float = 1.6
    ) -> None:
        """Find the strokes of each finger.

        Args:
            env: with an `ObserverWrapper`.
            seed: of sides and paces.
            grip: fraction of the torque limits, in (0, 1].
            seconds: s, that the hand stays closed.

        Raises:
            ValueError: for a value out of range, or as `Guided`.
        """
        super().__init__(env, seed)
        self.grip = validate.number("grip", grip, 0.0, 1.0, above=0.0)
        self._rate = hand_env(env).control_hz
        self._opening = OPENING * self._rate
        self._longest = validate.seconds("seconds", seconds) * self._rate + self._opening
        kinematics = FingerKinematics(self.hand)
        self._wrist, self._tree = WristMotion(self.hand), tree_of(self.hand)
        close, across, curl = kinematics.strokes(self.hand.rest_pose, self.hand.grasp_centre)
        self._strokes = close * kinematics.alone, across, curl
        self._directions = cKDTree(directions(DIRECTIONS))
        # What moves: about three axes, its own, along three; each finger across and curled.
        self._moving = 7 + 2 * kinematics.fingers
        of_side = (4,), (3,)
        of_record = (DIRECTIONS,), (PLACES, 3), ()
        self.remembers = ((), *of_side, (2, self._moving), *of_record, (self.joints,))

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """Grasp, and move.

        Args:
            observation: of one environment.
            state: steps since the side was chosen, its turn (4,) and shift (3,) m, pace and phase of all that moves,
                the `Record`, and the last pose (J,) rad.
            deterministic: of no effect.

        Returns:
            Action (J,), and the next state.
        """
        pose = self.belief.joint_angles
        if state is None:
            record = Record(np.zeros(DIRECTIONS), np.zeros((PLACES, 3)), np.array(0))
            step, side, paces, before = np.array(0), self._side(record, pose), self._paces(), pose
        else:
            step, turn, shift, paces, *kept, before = state
            record, side = Record(*kept), (Rotation.from_quat(turn), shift)
            record = self._noted(record, side, pose, np.flatnonzero(observation["contacts"]))
            if step >= self._longest:
                step, side, paces = np.array(0), self._side(record, pose), self._paces()
        torque = self._torque(int(step), side, paces, pose, (pose - before) * self._rate)
        turn, shift = side
        return torque, (step + 1, turn.as_quat(), shift, paces, *record, pose)

    def _torque(
        self, step: int, side: tuple[Rotation, Array], paces: Array, pose: Array, velocities: Array
    ) -> NDArray[np.float32]:
        closed = step >= self._opening
        wave = np.sin(2.0 * np.pi * (paces[0] * step / self._rate + paces[1]))
        torque = np.zeros(self.joints, np.float32)
        close, across, curl = self._strokes
        swing, curled = wave[7:].reshape(2, -1)
        grip = self.grip if closed else LET_GO
        torque[:] = np.clip(
            (grip * close + swing[:, None] * across + (CLAWED + CURLED * curled[:, None]) * curl).sum(axis=0), -1, 1
        )
        if self._wrist.free:
            turn, shift = side
            rocked = closed * (TILTED * wave[:3] + ROCKED * wave[3] * self._wrist.axis)
            there = Rotation.from_rotvec(turn.apply(rocked)) * turn
            goal = self._wrist.goal(there, shift + closed * SHIFTED * wave[4:7])
            torque[self._wrist.joints] = self._wrist.torque(goal, pose, velocities)
        return torque

    def _paces(self) -> Array:
        """(2, 7 + 2F): pace in Hz and phase in turns of all that moves."""
        return np.stack([self.rng.uniform(*PACES, self._moving), self.rng.random(self._moving)])

    def _noted(self, record: Record, side: tuple[Rotation, Array], pose: Array, patches: NDArray[np.int64]) -> Record:
        """`record` with what the `patches` feel at `pose` (J,) rad."""
        if patches.size == 0:
            return record
        skin = self.hand.patches
        away = placed_points(self._tree, pose, skin.position[patches], skin.link[patches]) - self.hand.grasp_centre
        felt, places = record.felt.copy(), record.places.copy()
        np.add.at(felt, self._nearest(away), 1.0)
        turn, shift = side
        index = (int(record.touches) + np.arange(patches.size)) % PLACES
        places[index] = turn.inv().apply(away - shift)
        return Record(felt, places, record.touches + patches.size)

    def _side(self, record: Record, pose: Array) -> tuple[Rotation, Array]:
        """From where to grasp next: a turn and a shift (3,) m, the best of some by what is new there and by the way."""
        count = int(record.touches)
        known = record.places[: min(count, PLACES)]
        candidates = [self._drawn() for _ in range(CANDIDATES if count >= FIRST and self._wrist.free else 1)]
        if len(candidates) == 1:
            return candidates[0]
        some = known[self.rng.choice(len(known), SAMPLE)]
        new = np.exp(-record.felt / ENOUGH)
        now = pose[self._wrist.joints]
        gain = [
            new[self._nearest(turn.apply(some) + shift)].mean()
            - FAR * float(np.abs(self._wrist.goal(turn, shift) - now).max())
            for turn, shift in candidates
        ]
        return candidates[int(np.argmax(gain))]

    def _drawn(self) -> tuple[Rotation, Array]:
        turn = self._wrist.draw(self.rng, FARTHEST_GRASP)
        return turn, turn.apply(self._wrist.axis) * self.rng.uniform(-LIFTED, LIFTED)

    def _nearest(self, away: Array) -> NDArray[np.int64]:
        """(K,) the directions in which places `away` (K, 3) m from the centre lie."""
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        return np.asarray(self._directions.query(away / np.maximum(distance, 1e-9))[1])
