"""Sliding: an exploration that follows the surface slowly, to where its map has nothing yet.

The hand holds its fingers like claws and turns about the object while their tips press lightly on it, so that they
slide over faces and edges (contour following with a whole hand, of Lederman & Klatzky's procedures). Of the ways that
it could turn next it takes the one along which least is known: directions from the grasp centre in which the map of
the episode so far has no occupied voxel, and few touches were felt. It opens where it is held up, and to start anew
from elsewhere.

Shapes: J joints, F fingers, D directions, M places of which K are asked, W ways, L looks.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from agents.clawed_fingers import ClawedFingers
from agents.policy import Guided, State
from agents.touch_record import DIRECTIONS, PLACES, Record, TouchRecorder
from agents.wrist_motion import WristMotion
from haptic_env import hand_env, validate
from haptic_env.arrays import Array

LIGHT, HARD, LET_GO = 0.12, 0.8, -0.8  # how fingers press: while they feel contact, while they do not, and open
CURLED, CURLS, ASIDE = 0.75, 0.15, 0.5  # of the joints' range: how fingers are curled, and how far they wag
PACES = (0.5, 0.385)  # Hz, at which they do, curled and aside
SHUT, LOST, REOPENED = 0.5, 0.3, 0.25  # closed so far and untouched for so long (s), a finger opens for so long (s)
OPENED, CLOSING = 0.5, 0.3  # s: how long the hand opens on its way to elsewhere, and closes there
HELD_UP, FOR, FREED, AGAIN = 0.25, 0.2, 0.2, 0.15  # rad from its goal, for s: it opens for s, and closes for s
WAYS, ELSEWHERE = 60, 16  # W, and how many other sides they are compared with
SHORTEST, LONGEST, LOOKS = 0.2, 1.2, 0.15  # rad: of a way, and from one look on it to the next
ROUNDABOUT, ROOM = 1.5, 0.3  # how much further than the hand turns a joint of the wrist may go, and rad besides
FARTHEST_TILT = np.deg2rad(140.0)  # of the hand's axis
LIFTED, SHIFTED, MOST_SHIFTED = 0.008, 0.008, 0.012  # m: along its axis and any way, and on one way at most
RECENT, SAMPLE, FIRST = 120, 40, 30  # places that tell where it touches, K that are asked, touches before any are
ENOUGH, MAPPED, OF_MAP = 4.0, 0.1, 0.6  # touches of a known direction; what is left of a mapped one; the map's part
AROUND, WIDTH = 0.5, 0.15  # how much what is unknown further on counts, and how far on (1 - cosine)
WORTH = 0.6  # of what is unknown elsewhere a way must have


class Way(NamedTuple):
    """How the hand moves next.

    Attributes:
        times: (3,) steps that were taken, that the hand is open for, in which case it goes there at once, and of all.
        turn: (4,) quaternion of the hand at its beginning.
        shift: (3,) m, likewise.
        rotated: (3,) rotation vector from there.
        shifted: (3,) m, of the hand at its end.
    """

    times: Array
    turn: Array
    shift: Array
    rotated: Array
    shifted: Array

    def at(self, share: float) -> tuple[Rotation, Array]:
        """Where the hand is after a share of the way: its turn and shift (3,) m."""
        turn = Rotation.from_rotvec(share * self.rotated) * Rotation.from_quat(self.turn)
        return turn, self.shift + share * (self.shifted - self.shift)

    def looks(self) -> tuple[Array, Array]:
        """Turns (L, 3, 3) and shifts (L, 3) m at places along the way, the last one its end."""
        count = max(1, int(np.linalg.norm(self.rotated) / LOOKS))
        share = np.arange(1, count + 1)[:, None] / count
        turns = Rotation.from_rotvec(share * self.rotated).as_matrix() @ Rotation.from_quat(self.turn).as_matrix()
        return turns, self.shift + share * (self.shifted - self.shift)

    @property
    def now(self) -> tuple[Rotation, Array]:
        """Where it is now."""
        step, opening, length = self.times
        return self.at(1.0 if opening > 0 else min(1.0, step / length))


class Sliding(Guided):
    """Turns about the object, fingertips sliding over it, to where the map has nothing yet.

    A hand whose wrist is fixed moves its fingers alone.
    """

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None, *, speed: float = 0.9) -> None:
        """Find out what the hand can do.

        Args:
            env: with an `ObserverWrapper`.
            seed: of ways and paces.
            speed: rad/s, with which the hand turns, in (0, 10].

        Raises:
            ValueError: for a speed out of range, or as `Guided`.
        """
        super().__init__(env, seed)
        self.speed = validate.number("speed", speed, 0.0, 10.0, above=0.0, unit="rad/s")
        self._rate = hand_env(env).control_hz
        self._fingers, self._wrist = ClawedFingers(self.hand), WristMotion(self.hand)
        self._recorder = TouchRecorder(self.hand)
        cosine = self._recorder.directions @ self._recorder.directions.T
        near = np.exp((cosine - 1.0) / WIDTH)
        self._near = near / near.sum(axis=1, keepdims=True)
        fingers = self._fingers.kinematics.fingers
        of_way, of_record = ((3,), (4,), (3,), (3,), (3,)), ((DIRECTIONS,), (PLACES, 3), ())
        self.remembers = (*of_way, *of_record, (2, fingers), (2, fingers), (2,), (self.joints,))

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """Slide on.

        Args:
            observation: of one environment.
            state: the `Way`, the `Record`, for how many steps each finger was lost and is to open (2, F), the phases
                (2, F) of how they wag, steps since the episode began and of being held up (2,), the last pose (J,) rad.
            deterministic: of no effect.

        Returns:
            Action (J,), and the next state.
        """
        pose = self.belief.joint_angles
        if state is None:
            fingers = self._fingers.kinematics.fingers
            still = Way(np.zeros(3), Rotation.identity().as_quat(), *np.zeros((3, 3)))
            way, record = self._opened(still, OPENED, CLOSING), Record.empty()
            lost, phases = np.zeros((2, fingers)), self.rng.random((2, fingers))
            clock, before = np.zeros(2), pose
        else:
            *kept, lost, phases, clock, before = state
            way, record = Way(*kept[:5]), Record(*kept[5:])
        record = self._recorder.noted(record, way.now, pose, np.flatnonzero(observation["contacts"]))
        way, held_up = self._next(way, record, pose, float(clock[1]))
        velocities = (pose - before) * self._rate
        press, lost = self._presses(way, lost, pose, observation["contacts"])
        pace = np.array(PACES)[:, None] * clock[0] / self._rate
        wagging = np.sin(2.0 * np.pi * (pace + phases))
        torque = self._fingers.torque(pose, velocities, CURLED + CURLS * wagging[0], ASIDE * wagging[1], press)
        if self._wrist.free:
            torque[self._wrist.joints] = self._wrist.torque(self._wrist.goal(*way.now), pose, velocities)
        way = way._replace(times=way.times + [1, 0, 0])
        action = np.clip(torque, -1.0, 1.0).astype(np.float32)
        return action, (*way, *record, lost, phases, np.array([clock[0] + 1, held_up]), pose)

    def _presses(self, way: Way, lost: Array, pose: Array, contacts: Any) -> tuple[Array, Array]:
        """With what each finger presses (F,), and for how many steps it was lost and is to open yet (2, F)."""
        touching = self._fingers.kinematics.touching(self.hand, contacts)
        opening = way.times[0] < way.times[1]
        missing, reopening = lost
        missing = np.where(touching | opening, 0.0, missing + 1.0)
        misses = (missing > LOST * self._rate) & (self._fingers.closed(pose) > SHUT) & (reopening == 0)
        reopening = np.where(misses, np.floor(REOPENED * self._rate), np.maximum(reopening - 1.0, 0.0))
        press = np.where(touching, LIGHT, HARD)
        press = np.where((reopening > 0) | opening, LET_GO, press)
        return press, np.stack([np.where(misses, 0.0, missing), reopening])

    def _next(self, way: Way, record: Record, pose: Array, held_up: float) -> tuple[Way, float]:
        """The way that goes on, or the next one, and for how many steps the hand was held up."""
        step, opening, length = way.times
        if opening == 0 and self._wrist.free:
            away = np.abs(self._wrist.goal(*way.now) - pose[self._wrist.joints]).max()
            held_up = held_up + 1.0 if away > HELD_UP else 0.0
            if held_up > FOR * self._rate:
                return self._opened(way, FREED, AGAIN), 0.0
        if step < length:
            return way, held_up
        return self._chosen(way, record), 0.0

    def _opened(self, way: Way, opening: float, closing: float) -> Way:
        """The same end as that of `way`, to which the hand goes at once and open, for so many seconds."""
        times = np.array([0, round(opening * self._rate), round((opening + closing) * self._rate)])
        turn, shift = way.at(1.0)
        return Way(times, turn.as_quat(), shift, np.zeros(3), shift)

    def _chosen(self, way: Way, record: Record) -> Way:
        """The next way, the best of some by what is unknown along them; or another side, if that has much more."""
        if not self._wrist.free:
            return self._opened(way, FREED, CLOSING)
        end = way.at(1.0)
        others = [self._drawn() for _ in range(ELSEWHERE if record.touches >= FIRST else 1)]
        ways = self._drawn_ways(end) if record.touches >= FIRST else []
        unknown = self._unknown(record)
        places = record.recent(RECENT)
        some = places[self.rng.choice(len(places), SAMPLE)] if len(places) else np.zeros((1, 3))

        sides = [(turn.as_matrix()[None], shift[None]) for turn, shift in others]
        along = [each.looks() for each in ways]
        turns, shifts = (np.concatenate(each) for each in zip(*sides, *along, strict=True))
        seen = np.einsum("lij,kj->lki", turns, some) + shifts[:, None]
        gain = unknown[self._recorder.nearest(seen)].mean(axis=1)
        there, on_ways = np.split(gain, [len(others)])
        if ways:
            of_way = np.repeat(np.arange(len(ways)), [len(shifts) for _, shifts in along])
            mean = np.bincount(of_way, on_ways) / np.bincount(of_way)
            if mean.max() >= WORTH * there.max():
                return ways[int(mean.argmax())]
        turn, shift = others[int(there.argmax())]
        still = Way(np.zeros(3), turn.as_quat(), shift, np.zeros(3), shift)
        return self._opened(still, OPENED, CLOSING)

    def _drawn_ways(self, start: tuple[Rotation, Array]) -> list[Way]:
        """Ways (W) from a turn and a shift (3,) m, as far as the wrist can go them."""
        turn, shift = start
        goal, found = self._wrist.goal(turn, shift), []
        for _ in range(WAYS):
            axis = self.rng.standard_normal(3)
            length = self.rng.uniform(SHORTEST, LONGEST)
            rotated = length * axis / np.linalg.norm(axis)
            then = Rotation.from_rotvec(rotated) * turn
            axis = then.apply(self._wrist.axis)
            wanted = axis * self.rng.uniform(-LIFTED, LIFTED) + SHIFTED * self.rng.standard_normal(3)
            shifted = shift + np.clip(wanted - shift, -MOST_SHIFTED, MOST_SHIFTED)
            turns = np.abs(self._wrist.goal(then, shifted) - goal).max()
            tilted = axis @ self._wrist.axis < np.cos(FARTHEST_TILT)
            if tilted or not self._wrist.reaches(then, shifted) or turns > ROUNDABOUT * length + ROOM:
                continue
            steps = max(5, int(length / self.speed * self._rate))
            found.append(Way(np.array([0, 0, steps]), turn.as_quat(), shift, rotated, shifted))
        return found

    def _drawn(self) -> tuple[Rotation, Array]:
        turn = self._wrist.draw(self.rng)
        return turn, turn.apply(self._wrist.axis) * self.rng.uniform(-LIFTED, LIFTED)

    def _unknown(self, record: Record) -> Array:
        """(D,) how little is known of each direction, and of those around it."""
        occupied = self.belief.grid.centres()[self.map_now() > 0.5]
        mapped = np.ones(DIRECTIONS)
        if len(occupied):
            mapped[self._recorder.nearest(occupied - self.hand.grasp_centre)] = MAPPED
        unknown = OF_MAP * mapped + (1.0 - OF_MAP) * np.exp(-record.felt / ENOUGH)
        return np.asarray(unknown + AROUND * (self._near @ unknown))
