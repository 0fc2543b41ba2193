"""A world to explore: objects and noise drawn afresh each episode, a belief to look at, a reward for knowing more."""

from __future__ import annotations

from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np

from agents.hold_action import HoldAction
from haptic_env import hand_env, registration, shapes
from haptic_env.objects import reset_options
from haptic_lab.learning.presets import FOUR, NAME, RAW, TrainingWorld
from haptic_lab.raw_pose import RawPose
from observer import (
    BeliefObservation,
    DecideWhenSure,
    DecisionReward,
    HapticSLAM,
    InformationGainReward,
    ObserverWrapper,
    PoseOnly,
    ShapePosterior,
)
from observer.wrappers.belief_observation import OF_MAPS

# Objects come in so many sizes, of which every third is kept for evaluation: a model is compiled for each, and kept.
SIZES = 15
HELD_OUT = slice(1, None, 3)


class DomainRandomisation(gym.Wrapper):
    """Draws the object and sigma for each episode, and tells sigma to the observer, unless that believes another."""

    def __init__(
        self, env: gym.Env[Any, Any], observer: HapticSLAM | PoseOnly | None, world: TrainingWorld, held_out: bool
    ) -> None:
        """Keep the sizes of training and those of evaluation apart.

        Args:
            env: that is explored.
            observer: which is told sigma; None: nobody is.
            world: what may be drawn.
            held_out: whether sizes are those of evaluation.
        """
        super().__init__(env)
        self._observer, self._sigma_deg, self._shapes = observer, world.sigma_deg, list(world.shapes)
        self._tells_sigma = "sigma_deg" not in world.told(world.noise)
        scales = 1.0 + world.size_jitter * np.linspace(-1.0, 1.0, SIZES)
        self._scales = scales[HELD_OUT] if held_out else np.delete(scales, HELD_OUT)
        self._rng = np.random.default_rng()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        sigma = float(self._rng.uniform(*self._sigma_deg))
        shape = str(self._rng.choice(self._shapes))
        scale = self._rng.choice(self._scales)
        told = {name: value for name, value in reset_options(options).items() if value is not None}
        drawn: dict[str, Any] = {"shape": shape, "sigma_deg": sigma, **told}
        drawn.setdefault("size", scale * shapes.default_size(drawn["shape"]))
        result = self.env.reset(seed=seed, options=drawn)
        if self._observer is not None and self._tells_sigma:
            self._observer.sigma_deg = drawn["sigma_deg"]
        return result


def explored(world: TrainingWorld, held_out: bool = False, render_mode: str | None = None) -> gym.Env[Any, Any]:
    """Make the environment that a learner sees.

    Args:
        world: what is explored and how it is rewarded.
        held_out: whether objects have the sizes of evaluation, not of training.
        render_mode: of the scene.

    Returns:
        The environment, with an observer beside it.
    """
    env = unobserved(world, render_mode)
    base = hand_env(env)
    told = world.told(world.noise, base.hand)
    names = world.task == NAME
    observer: HapticSLAM | PoseOnly
    if not names or set(world.observation) & set(OF_MAPS):
        observer = HapticSLAM(base.hand, particles=1, control_hz=base.control_hz, **told)
        stride = world.stride
    else:
        of_pose = PoseOnly if world.filtered else partial(RawPose, sigma_deg=None)
        observer = of_pose(base.hand, control_hz=base.control_hz, stride=world.stride, **told)
        stride = 1
    shape = None
    if names:
        coarse = {name: getattr(world, name) for name in ("variants", "samples", "temper")}
        candidates = None if world.shapes == FOUR else world.shapes
        shape = ShapePosterior(base.hand, candidates, stride=stride, **coarse, **jitter(world))
    env = ObserverWrapper(DomainRandomisation(env, observer, world, held_out), observer, shape)
    if names:
        env = DecisionReward(DecideWhenSure(env, world.threshold, world.sure_seconds), world.price, world.least)
    if world.observation != (RAW,):
        env = BeliefObservation(env, world.observation)
    env = HoldAction(env, world.hold)
    return env if names else InformationGainReward(env, "surface")  # of a whole decision, for drawing a map takes time


def unobserved(world: TrainingWorld, render_mode: str | None = None) -> gym.Env[Any, Any]:
    """Make the environment without an observer, in which nothing is drawn yet as `DomainRandomisation` does.

    Args:
        world: what is explored.
        render_mode: of the scene.

    Returns:
        The environment; its info has the truth.
    """
    shapes.allow(world.shapes)  # which whoever asked for it has imported too
    kept: dict[str, Any] = {"episode_seconds": world.seconds, "reveal_truth": True, "render_mode": render_mode}
    return registration.make(world.env, wrist=world.wrist, **kept, **jitter(world), **world.noise)


def jitter(world: TrainingWorld) -> dict[str, Any]:
    """Say how much the object varies.

    Args:
        world: that is explored.

    Returns:
        Keyword arguments of an environment, and of a `ShapePosterior`.
    """
    names = ("size_jitter", "yaw_jitter", "position_jitter", "rotation_jitter")
    return {name: getattr(world, name) for name in names}
