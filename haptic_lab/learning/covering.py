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
from agents.rhythm import Memory, Rhythm
from haptic_env import hand_env
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.shapes.base import Solid
from haptic_lab.learning.explored import DomainRandomisation, unobserved
from haptic_lab.learning.presets import TrainingWorld
from observer import HapticSLAM, metrics
from observer.kinematics import tree_of
from observer.surface_metrics import touched_at_once

SPACING = 0.004  # m, of the points of the skin that are asked for
VOXELS = 1.5  # within which a touch counts for a voxel of the surface
ENOUGH = 8  # touches of a voxel, one for each patch and decision, that count as much as any more: it is then mapped


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
        if contacts.any():
            self.places.append(touched_at_once(self._skin, self._tree, joint_angles, contacts, solid))

    def share(self, solid: Solid) -> float:
        """Say how much of the surface was touched.

        Args:
            solid: the same.

        Returns:
            Mean over the voxels of the surface, 1 of those that were touched `ENOUGH` times, in [0, 1].
        """
        surface = metrics.surface_places(solid, self._grid)
        if not self.places or not len(surface):
            return 0.0
        tree, within = cKDTree(np.concatenate(self.places)), VOXELS * self._grid.resolution
        return float(np.minimum(1.0, tree.query_ball_point(surface, within, return_length=True) / ENOUGH).mean())


class Covering:
    """Explores without an observer, which a `Rhythm` does not need, and counts where the skin has touched the object.

    A touch counts by the truth, as in `DecisionReward`, for training alone.
    """

    def __init__(self, world: TrainingWorld, held_out: bool) -> None:
        """Make what is explored.

        Args:
            world: with the task "map".
            held_out: whether objects have the sizes of evaluation.
        """
        self._shapes = world.shapes
        drawn = DomainRandomisation(unobserved(world), None, world, held_out)
        self._env: gym.Env[Any, Any] = HoldAction(drawn, world.hold)
        self._touched = Touched(hand_env(self._env).hand)
        self._rng = np.random.default_rng(0)  # which no rhythm asks

    def play(self, rhythm: Rhythm, seed: int) -> tuple[float, int]:
        """Let a rhythm explore.

        Args:
            rhythm: that explores.
            seed: of the world; those that follow each other have the shapes in turn.

        Returns:
            The share of the surface that was touched, in [0, 1], and how many decisions it took.
        """
        observation, _ = self._env.reset(seed=seed, options={"shape": self._shapes[seed % len(self._shapes)]})
        solid: Solid = self._env.get_wrapper_attr("solid")
        memory: Memory = ()
        decisions, over = 0, False
        self._touched.reset()
        while not over:
            torque, memory = rhythm.predict(observation["contacts"], memory, decisions == 0, True, self._rng)
            observation, _, terminated, truncated, info = self._env.step(torque)
            decisions, over = decisions + 1, terminated or truncated
            self._touched.take(info["truth"]["joint_angles"], observation["contacts"].astype(bool), solid)
        return self._touched.share(solid), decisions
