"""A task without any observer: what is felt goes in, torques and a guess come out, and the guess is what is paid.

Shapes: J joints, C names.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from agents.hold_action import HoldAction
from haptic_lab.learning.explored import DomainRandomisation, unobserved
from haptic_lab.learning.presets import TrainingWorld

SCALE = 8.0  # of the logits: an action of 1 against -1 is e^16 times as probable


class GuessReward(gym.Wrapper):
    """Actions (J + C,) are torques and logits of the names; the reward of a decision is minus the cross-entropy of the
    guess with the truth, as a share of that of knowing nothing (ln C)."""

    def __init__(self, env: gym.Env[Any, Any], labels: tuple[str, ...]) -> None:
        """Widen the actions.

        Args:
            env: whose info has the truth.
            labels: (C,) names.
        """
        super().__init__(env)
        joints = env.action_space.shape
        assert joints is not None
        self.joints, self.labels = joints[0], labels
        self.action_space = gym.spaces.Box(-1.0, 1.0, (self.joints + len(labels),), np.float32)
        self.truth = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        self.truth = self.labels.index(info["truth"]["shape"])
        return observation, {}

    def step(self, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, _, terminated, truncated, _ = self.env.step(action[: self.joints])
        guess = guess_of(action, self.joints)
        reward = float(np.log(guess[self.truth])) / np.log(len(self.labels))
        over = {"is_success": bool(guess.argmax() == self.truth)} if terminated or truncated else {}
        return observation, float(reward), terminated, truncated, over


def guess_of(action: NDArray[Any], joints: int) -> NDArray[np.float64]:
    """Read the guess of an action.

    Args:
        action: (J + C,).
        joints: J.

    Returns:
        (C,) probabilities.
    """
    guess: NDArray[np.float64] = softmax(SCALE * np.asarray(action[joints:], dtype=np.float64))
    return guess


def guessing(world: TrainingWorld) -> gym.Env[Any, Any]:
    """Make the environment of a task in which a learner names the object by itself.

    Args:
        world: of the task.

    Returns:
        The environment: joint angles and contacts, actions (J + C,).
    """
    return GuessReward(felt_alone(world), world.shapes)


def felt_alone(world: TrainingWorld, held_out: bool = False, render_mode: str | None = None) -> gym.Env[Any, Any]:
    """Make the environment of a task without observer and reward; its info has the truth.

    Args:
        world: of the task.
        held_out: whether objects have the sizes of evaluation.
        render_mode: of the scene.

    Returns:
        The environment: joint angles and contacts, torques (J,).
    """
    return HoldAction(DomainRandomisation(unobserved(world, render_mode), None, world, held_out), world.hold)
