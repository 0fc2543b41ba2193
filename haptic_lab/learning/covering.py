"""How much of a surface is touched: what a search for maps is paid by, for drawing maps takes longer than exploring.

Shapes: J joints, P patches.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from agents.hold_action import HoldAction
from agents.rhythm import Memory
from haptic_env import hand_env
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.shapes.base import Solid
from haptic_lab.learning.acting import Candidate, act
from haptic_lab.learning.explored import DomainRandomisation, unobserved
from haptic_lab.learning.presets import FELT, TrainingWorld
from observer import HapticSLAM, ObserverWrapper, PoseOnly, metrics
from observer.kinematics import tree_of
from observer.surface_metrics import touched_at_once
from observer.wrappers.belief_observation import features_of

SPACING = 0.004  # m, of the points of the skin that are asked for
VOXELS = 1.5  # within which a touch counts for a voxel of the surface
NOTHING = np.zeros((0, 3))
ENOUGH = 8  # touches of a voxel, one for each patch and decision, that count as much as any more: it is then mapped
LEAST = 1e-3  # share of a surface below which less is no worse


class Touched:
    """Where the skin has touched a solid, by the truth."""

    def __init__(self, hand: Hand) -> None:
        """Spread points over the skin.

        Args:
            hand: with J joints and P patches.
        """
        self._grid = HapticSLAM(hand, particles=1).grid
        self._skin, self._tree = hand.patches.surface(SPACING), tree_of(hand)
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        self.places: list[Array] = []

    def take(self, joint_angles: Array, contacts: NDArray[np.bool_], solid: Solid) -> None:
        """Take in one place for each patch that feels contact, where its skin is nearest to the surface.

        Args:
            joint_angles: (J,) rad, the true ones.
            contacts: (P,).
            solid: that is touched.
        """
        touched = touched_at_once(self._skin, self._tree, joint_angles, contacts, solid) if contacts.any() else NOTHING
        self.places.append(touched)

    def share(self, solid: Solid) -> float:
        """Say how much of the surface was touched.

        Args:
            solid: the same.

        Returns:
            Mean over the voxels of the surface, 1 of those that were touched `ENOUGH` times, in [0, 1].
        """
        return float(self.shares(solid)[-1]) if self.places else 0.0

    def shares(self, solid: Solid) -> Array:
        """Say how much of the surface had been touched by each time that something was taken in.

        Args:
            solid: the same.

        Returns:
            (T,) of T calls of `take`, as `share`.
        """
        surface, gained = metrics.surface_places(solid, self._grid), np.zeros(len(self.places))
        when = np.repeat(np.arange(len(gained)), [len(each) for each in self.places])
        if not len(when) or not len(surface):
            return gained
        tree, within = cKDTree(np.concatenate(self.places)), VOXELS * self._grid.resolution
        for near in tree.query_ball_point(surface, within, return_sorted=True):
            np.add.at(gained, when[near[:ENOUGH]], 1.0)
        return np.asarray(gained.cumsum() / (ENOUGH * len(surface)))


class Covering:
    """Explores, and counts where the skin has touched the object; with a pose filter where a candidate reads beliefs.

    A touch counts by the truth, as in `DecisionReward`, for training alone.
    """

    def __init__(self, world: TrainingWorld, held_out: bool) -> None:
        """Make what is explored.

        Args:
            world: with the task "map".
            held_out: whether objects have the sizes of evaluation.
        """
        self._world, self._features = world, None
        env = unobserved(world)
        base = hand_env(env)
        if world.observation == FELT:
            env = DomainRandomisation(env, None, world, held_out)
        else:
            observer = PoseOnly(base.hand, control_hz=base.control_hz, **world.told(world.noise, base.hand))
            env = ObserverWrapper(DomainRandomisation(env, observer, world, held_out), observer)
            self._features = features_of(env, world.observation)
        self._env: gym.Env[Any, Any] = HoldAction(env, world.hold)
        self._touched = Touched(hand_env(self._env).hand)

    def play(self, candidate: Candidate, seed: int) -> tuple[float, int]:
        """Let a candidate explore.

        Args:
            candidate: that explores.
            seed: of the world; those that follow each other have the shapes in turn.

        Returns:
            The share of the surface that was touched, in [0, 1], in the end or, where it is paid how soon, its
            geometric mean through time; and how many decisions it took.
        """
        world = self._world
        observation, _ = self._env.reset(seed=seed, options={"shape": world.shapes[seed % len(world.shapes)]})
        solid: Solid = self._env.get_wrapper_attr("solid")
        memory: Memory = ()
        decisions, over = 0, False
        self._touched.reset()
        while not over:
            shown = observation["contacts"]
            if self._features is not None:
                belief = self._env.get_wrapper_attr("belief")
                shown = self._features.vector(belief, shown, None, decisions * world.hold)
            torque, memory = act(candidate, shown, memory, decisions == 0)
            observation, _, terminated, truncated, info = self._env.step(torque)
            decisions, over = decisions + 1, terminated or truncated
            self._touched.take(info["truth"]["joint_angles"], observation["contacts"].astype(bool), solid)
        if not world.soon:
            return self._touched.share(solid), decisions
        return float(np.exp(np.log(np.maximum(self._touched.shares(solid), LEAST)).mean())), decisions
