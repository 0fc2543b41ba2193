"""How much of a surface is touched: what a search for maps is paid by, for drawing maps takes longer than exploring.

Shapes: P patches, M places.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from scipy.spatial import cKDTree

from agents.hold_action import HoldAction
from agents.rhythm import Memory, Rhythm
from haptic_env import hand_env
from haptic_env.arrays import Array
from haptic_lab.learning.explored import DomainRandomisation, unobserved
from haptic_lab.learning.presets import TrainingWorld
from observer import HapticSLAM, metrics
from observer.kinematics import placed_points, tree_of

SPACING = 0.004  # m, of the points of the skin that are asked for
VOXELS = 1.5  # within which a touch counts for a voxel of the surface
ENOUGH = 8  # touches of a voxel, one for each patch and decision, that count as much as any more: it is then mapped


class Covering:
    """Explores without an observer, which a `Rhythm` does not need, and counts where the skin has touched the object.

    A touch counts by the truth, as in `DecisionReward`, for training alone. What a map shows goes with it (docs).
    """

    def __init__(self, world: TrainingWorld, held_out: bool) -> None:
        """Make what is explored.

        Args:
            world: with the task "map".
            held_out: whether objects have the sizes of evaluation.
        """
        self._world = world
        self._env: gym.Env[Any, Any] = HoldAction(
            DomainRandomisation(unobserved(world), None, world, held_out), world.hold
        )
        self._hand = hand_env(self._env).hand
        self._grid = HapticSLAM(self._hand, particles=1).grid
        self._skin, self._tree = self._hand.patches.surface(SPACING), tree_of(self._hand)
        self._rng = np.random.default_rng(0)

    def play(self, rhythm: Rhythm, seed: int) -> tuple[float, int]:
        """Let a rhythm explore.

        Args:
            rhythm: that explores.
            seed: of the world; those that follow each other have the shapes in turn.

        Returns:
            The share of the surface that was touched, in [0, 1], and how many decisions it took.
        """
        shapes = self._world.shapes
        observation, info = self._env.reset(seed=seed, options={"shape": shapes[seed % len(shapes)]})
        memory: Memory = ()
        places, decisions, over = [], 0, False
        while not over:
            torque, memory = rhythm.predict(observation["contacts"], memory, decisions == 0, True, self._rng)
            observation, _, terminated, truncated, info = self._env.step(torque)
            decisions, over = decisions + 1, terminated or truncated
            places.append(self._touched(info["truth"]["joint_angles"], observation["contacts"].astype(bool)))
        solid = self._env.get_wrapper_attr("solid")
        surface, touched = metrics.surface_places(solid, self._grid), np.concatenate(places)
        if not len(touched) or not len(surface):
            return 0.0, decisions
        near = cKDTree(touched).query_ball_point(surface, VOXELS * self._grid.resolution, return_length=True)
        return float(np.minimum(1.0, near / ENOUGH).mean()), decisions

    def _touched(self, joint_angles: Array, contacts: Array) -> Array:
        """(M, 3) m, one place for each patch that feels contact, where its skin is nearest to the surface."""
        mine = np.flatnonzero(contacts[self._skin.patch])
        if not len(mine):
            return np.empty((0, 3))
        patch, solid = self._skin.patch[mine], self._env.get_wrapper_attr("solid")
        points = placed_points(self._tree, joint_angles, self._skin.points[mine], self._skin.link[mine])
        gap = np.abs(solid.signed_distance(points))
        order = np.lexsort((gap, patch))
        nearest = order[np.unique(patch[order], return_index=True)[1]]
        return np.asarray(points[nearest[gap[nearest] <= metrics.TOUCH_TOLERANCE]])
