"""A policy that reads the truth and looks ahead in the task's own physics: what steering with full knowledge can do, at
least.

Model predictive control by random shooting: from the true state, candidates are simulated with the true object, and for
each finger the one is played that touches most of what was touched too little as yet, as
`haptic_lab.learning.covering.Touched` counts it. How what can be touched is touched, it has dreamt beforehand.

Shapes: K candidates, T control steps, J joints, F fingers, L links, V voxels of the surface.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from agents.finger_kinematics import FingerKinematics
from agents.policy import Policy, State
from agents.rollouts import ALONG, spheres_of
from haptic_env import hand_env
from haptic_env.arrays import Array
from haptic_lab.learning.covering import ENOUGH, VOXELS
from observer import HapticSLAM, metrics

FAR = 0.05  # m: what is to be touched and is further away draws a finger no more
APPROACH = 0.3  # voxels that are touched enough, which it is worth to be nearer by `FAR`
LASTING = 0.4  # s, for so long torques by chance stay much the same
DAMPING = 0.05  # s, of a finger that is drawn to a pose, as a fraction of its torque limit for each rad/s
Voxels = NDArray[np.int64]


class Moment(NamedTuple):
    """How a finger can touch.

    Attributes:
        pose: (J,) rad.
        torque: (J,) fractions.
        touched: indices of the voxels.
    """

    pose: Array
    torque: Array
    touched: Voxels


class Aim(NamedTuple):
    """A candidate that is drawn to a pose, by `stiffness` fractions of the torque limits for each rad."""

    pose: Array
    torque: Array
    stiffness: float


class Course(NamedTuple):
    """What a candidate does.

    Attributes:
        torques: (T, J) fractions.
        touches: (F, V) how often each finger touches each voxel.
        ends: (F,) m, how far each finger ends from what is still to be touched.
    """

    torques: Array
    touches: Array
    ends: Array


class Oracle(Policy):
    """Knows the object, its place and the true state of the hand, whose fingers share no joint and are stopped by the
    object alone: so that each may follow another candidate.

    Attributes:
        reached: (V,) which voxels it knows how to touch.
    """

    candidates = 32  # K
    ahead, played, every = 25, 10, 2  # control steps that are simulated, that are played, and from touch to touch
    dreams = 150.0  # s, in which it learns what can be touched

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        super().__init__(env, seed)
        self._env: Any = hand_env(env)
        self._hand = self._env.hand
        self._kinematics, self._spheres = FingerKinematics(self._hand), spheres_of(self._hand)
        self._joints = self._kinematics.alone  # (F, J)
        assert (self._kinematics.moves == self._joints).all()
        self._grid = HapticSLAM(self._hand, particles=1).grid

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        step = 0 if state is None else int(state[0])
        if step == 0:
            self._begin()
            self._dream()
        if step % self.every == 0:
            self._count += self._felt(self._env._data).sum(axis=0)
        if step % self.played == 0:
            self._plan()
        return self._torques[step % self.played].astype(np.float32), (np.array(step + 1),)

    def _begin(self) -> None:
        """Look at a world."""
        self._model, self._data = self._env._model, mujoco.MjData(self._env._model)
        finger = self._kinematics.links.argmax(axis=0)  # (L,)
        bodies = np.array([self._model.body(link.body).id for link in self._hand.links])
        self._finger_of_geom = np.full(self._model.ngeom, -1)
        for body, mine in zip(bodies, finger, strict=True):
            self._finger_of_geom[self._model.geom_bodyid == body] = mine
        self._body_of_sphere, self._finger_of_sphere = np.repeat(bodies, ALONG), np.repeat(finger, ALONG)
        self._surface = metrics.surface_places(self._env.solid, self._grid)
        self._near = cKDTree(self._surface)
        self._count, self.reached = np.zeros(len(self._surface)), np.zeros(len(self._surface), dtype=bool)
        self._moments: list[list[Moment]] = [[] for _ in self._joints]
        self._torques = np.zeros((self.ahead, self.joints))

    def _dream(self) -> None:
        """Follow one habit after the other, and note what was touched."""
        mujoco.mj_copyData(self._data, self._model, self._env._data)
        for _ in range(round(self.dreams * self._env.control_hz / self.ahead)):
            for torque in self._habit(self._data.qpos):
                self._step(torque)
                self._note(torque, self._felt(self._data), least=0)

    def _note(self, torque: Array, felt: Array, least: int) -> None:
        """Note how each finger touches, where at least so many of the voxels are new."""
        for mine, moments in zip(felt, self._moments, strict=True):
            touched = np.flatnonzero(mine)
            if len(touched) and np.count_nonzero(~self.reached[touched]) >= least:
                self.reached[touched] = True
                moments.append(Moment(self._data.qpos.copy(), torque.copy(), touched))

    def _plan(self) -> None:
        """Choose what is played next, finger by finger: the one that comes later knows what the other will touch."""
        wanted = self.reached & (self._count < ENOUGH)
        left = cKDTree(self._surface[wanted]) if wanted.any() else None
        courses = [self._course(each, left) for each in self._asked(wanted)]
        count, chosen = self._count.copy(), np.zeros((self.ahead, self.joints))
        for f in self.rng.permutation(len(self._joints)):
            enough = [np.minimum(count + each.touches[f], ENOUGH).sum() / ENOUGH for each in courses]
            away = [each.ends[f] / FAR for each in courses]
            best = courses[int(np.argmax(np.array(enough) - APPROACH * np.array(away)))]
            chosen[:, self._joints[f]] = best.torques[:, self._joints[f]]
            count += best.touches[f]
        self._torques = chosen

    def _asked(self, wanted: NDArray[np.bool_]) -> list[Array | Aim]:
        """K candidates: what was chosen last, goes on; moments in which was touched what is wanted; habits."""
        now = self._env._data.qpos
        last = np.repeat(self._torques[-1:], self.played, axis=0)
        asked: list[Array | Aim] = [np.concatenate([self._torques[self.played :], last])]
        worth = [np.array([wanted[each.touched].sum() for each in moments], float) for moments in self._moments]
        for _ in range(self.candidates // 2):
            pose, torque = now.copy(), np.zeros(self.joints)
            for joints, moments, weights in zip(self._joints, self._moments, worth, strict=True):
                if weights.any():
                    moment = moments[self.rng.choice(len(moments), p=weights / weights.sum())]
                    pose[joints], torque[joints] = moment.pose[joints], moment.torque[joints]
            asked.append(Aim(pose, torque, 10.0 ** self.rng.uniform(-0.5, 1.0)))
        return asked + [self._habit(now) for _ in range(self.candidates - len(asked))]

    def _habit(self, pose: Array) -> Array:
        """(T, J) fractions: closing about the object or a place on it, opening first, a sweep, or torques by chance."""
        rng, hz, kind = self.rng, self._env.control_hz, self.rng.integers(4)
        if kind == 0:
            torques = rng.normal(size=(self.ahead, self.joints))
            keep = np.exp(-1.0 / (LASTING * hz))
            for step in range(1, self.ahead):
                torques[step] = keep * torques[step - 1] + np.sqrt(1.0 - keep**2) * torques[step]
            return np.clip(torques, -1.0, 1.0)
        place = self._surface[rng.integers(len(self._surface))] if rng.random() < 0.5 else self._hand.grasp_centre
        close, across, curl = self._kinematics.strokes(pose, place)
        grip = np.tile(rng.uniform(0.2, 1.0, len(close)), (self.ahead, 1))
        sideways, curled = np.tile(rng.uniform(-1.0, 1.0, (2, 1, len(close))), (1, self.ahead, 1))
        if kind == 1:
            grip[: rng.integers(2, 10)] *= -1.0
        if kind == 2:
            turns = np.arange(self.ahead)[:, None] / hz * rng.uniform(0.3, 1.5, (2, 1, len(close)))
            swing = np.cos(2 * np.pi * (turns + rng.random((2, 1, len(close)))))
            grip, sideways = grip * swing[0], swing[1]
        return np.clip(grip @ close + sideways @ across + curled @ curl, -1.0, 1.0)

    def _course(self, asked: Array | Aim, left: cKDTree | None) -> Course:
        """Simulate a candidate from the true state; `left` are the places that are still to be touched."""
        data = self._data
        mujoco.mj_copyData(data, self._model, self._env._data)
        touches, torques = np.zeros((len(self._joints), len(self._surface))), np.empty((self.ahead, self.joints))
        for step in range(self.ahead):
            if isinstance(asked, Aim):
                pull = asked.stiffness * (asked.pose - data.qpos) - DAMPING * data.qvel
                torques[step] = np.clip(asked.torque + pull, -1.0, 1.0)
            else:
                torques[step] = asked[step]
            self._step(torques[step])
            if (step + 1) % self.every == 0:
                felt = self._felt(data)
                self._note(torques[step], felt, least=1)
                touches += felt
        ends = np.zeros(len(self._joints))
        if left is not None:
            axes = data.xmat[self._body_of_sphere].reshape(-1, 3, 3)[..., 2]
            centres = data.xpos[self._body_of_sphere] + self._spheres.along[:, None] * axes
            gaps = np.clip(left.query(centres)[0] - self._spheres.radius, 0.0, FAR)
            ends = np.array([gaps[self._finger_of_sphere == f].min() for f in range(len(ends))])
        return Course(torques, touches, ends)

    def _step(self, torque: Array) -> None:
        """One control step of the physics, without the noise of motors."""
        self._data.ctrl[:] = torque
        mujoco.mj_step(self._model, self._data, self._env.substeps)
        mujoco.mj_step1(self._model, self._data)

    def _felt(self, data: mujoco.MjData) -> Array:
        """(F, V): how often each finger touches each voxel now, once by each point of contact."""
        felt = np.zeros((len(self._joints), len(self._surface)))
        if data.ncon:
            finger = self._finger_of_geom[data.contact.geom].max(axis=1)
            for point in np.flatnonzero((finger >= 0) & (data.contact.dist < 0.0)):
                near = self._near.query_ball_point(data.contact.pos[point], VOXELS * self._grid.resolution)
                felt[finger[point], near] += 1.0
        return felt
