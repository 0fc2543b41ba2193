"""What a policy is: Stable-Baselines3's `predict`, so that trained models and these are used alike.

Shapes: J joints.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.hand import Hand
from observer.belief import Belief
from observer.shape_posterior import ShapePosterior

State = tuple[NDArray[Any], ...] | None
EpisodeStart = NDArray[np.bool_] | bool | None


class Policy(ABC):
    """A policy for `env`, whose hand (`env.unwrapped.hand`) and control rate it may read, never its truth."""

    guided: ClassVar[bool] = False
    """Whether it reads beliefs, so that `env` must have an `ObserverWrapper` (see `Guided`)."""
    asks_shape: ClassVar[bool] = False
    """Whether it also asks what the object may be, so that the wrapper must have a `shape`."""
    blind: ClassVar[bool] = False
    """Whether it commands the same whatever is felt."""

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        self.joints: int = env.action_space.shape[0]  # type: ignore[index]
        self.rng = np.random.default_rng(validate.seed(seed))
        self.name = type(self).__name__  # `agents.make` puts the registered name here

    @abstractmethod
    def predict(
        self, observation: Any, state: State = None, episode_start: EpisodeStart = None, deterministic: bool = False
    ) -> tuple[NDArray[np.float32], State]:
        """Action (J,) in [-1, 1], and the state to hand to the next call; None or `episode_start` starts anew."""


class Guided(Policy):
    """A policy that reads what an observer believes.

    The beliefs are those of the `ObserverWrapper(env, observer, shape)` that `env` is or has inside: whoever composes
    the three says which observer guides the hand. `predict` keeps its signature, and nothing else need be called.
    """

    guided = True

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        super().__init__(env, seed)
        self.env = env
        self.hand: Hand = env.unwrapped.hand  # type: ignore[attr-defined]
        if not env.has_wrapper_attr("belief"):
            raise ValueError(
                f"{type(self).__name__} is guided by beliefs, which {env} has none of; wrap it: "
                "ObserverWrapper(env, HapticSLAM(hand), ShapePosterior(hand))"
            )

    @property
    def belief(self) -> Belief:
        """What the observer believes now."""
        return self.env.get_wrapper_attr("belief")

    @property
    def shape(self) -> ShapePosterior:
        """What the object is believed to be; raises `ValueError` where the observer is not asked."""
        shape = self.env.get_wrapper_attr("shape")
        if shape is None:
            raise ValueError(
                f"{self.name} asks what the object may be, which nothing infers here; wrap the environment in "
                "ObserverWrapper(env, observer, ShapePosterior(hand))"
            )
        return shape


def starts(episode_start: EpisodeStart) -> bool:
    """Whether `episode_start` says that an episode begins."""
    return episode_start is not None and bool(np.any(episode_start))


def act(
    policy: Policy, observation: Any, state: State = None, episode_start: EpisodeStart = None
) -> tuple[NDArray[np.float32], State]:
    """What `policy` predicts, for whoever runs it; raises `ValueError` with its name for what is not finite."""
    action, state = policy.predict(observation, state, episode_start)
    if not np.isfinite(action).all():
        raise ValueError(f"policy {policy.name!r} commands torques that are not finite: {np.asarray(action).tolist()}")
    return action, state
