"""What a learner explores: objects and noise drawn afresh each episode, a belief to look at, a reward for deciding."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv

from agents.hold_action import HoldAction
from haptic_env import hand_env, registration, shapes
from haptic_lab.learning.presets import FOUR, RAW, TrainingWorld
from haptic_lab.processes import end_with_parent
from observer import (
    BeliefObservation,
    DecideWhenSure,
    DecisionReward,
    HapticSLAM,
    ObserverWrapper,
    PoseOnly,
    ShapePosterior,
)

# Objects come in so many sizes, of which every third is kept for evaluation: a model is compiled for each, and kept.
SIZES = 15
HELD_OUT = slice(1, None, 3)
Maker = Callable[[], gym.Env[Any, Any]]


class DomainRandomisation(gym.Wrapper):
    """Draws the object and sigma for each episode, and tells sigma to the observer, unless that believes another."""

    def __init__(
        self, env: gym.Env[Any, Any], observer: HapticSLAM | PoseOnly, world: TrainingWorld, held_out: bool
    ) -> None:
        """Keep the sizes of training and those of evaluation apart.

        Args:
            env: that is explored.
            observer: which is told sigma.
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
        size = self._rng.choice(self._scales) * shapes.default_size(shape)
        if self._tells_sigma:
            self._observer.sigma_deg = sigma
        drawn = {"shape": shape, "size": size, "sigma_deg": sigma}
        return self.env.reset(seed=seed, options=drawn | (options or {}))


class InfoFilter(gym.Wrapper):
    """Leaves of `info` what a learner reads: beliefs would be copied from process to process at every step."""

    def step(self, action: NDArray[np.float32]) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        *told, info = self.env.step(action)
        kept = {key: info[key] for key in ("is_success", "decision") if key in info}
        return *told, kept

    def reset(self, **keywords: Any) -> tuple[Any, dict[str, Any]]:
        return self.env.reset(**keywords)[0], {}


def make_env(world: TrainingWorld, held_out: bool = False) -> gym.Env[Any, Any]:
    """Make the environment that a learner sees.

    Args:
        world: what is explored and how it is rewarded.
        held_out: whether objects have the sizes of evaluation, not of training.

    Returns:
        The environment, with an observer beside it.
    """
    shapes.allow(world.shapes)  # which whoever asked for it has imported too
    vary = {name: getattr(world, name) for name in ("size_jitter", "yaw_jitter", "position_jitter")}
    env = registration.make(world.env, episode_seconds=world.seconds, reveal_truth=True, **vary, **world.noise)
    base = hand_env(env)
    told = world.told(world.noise, base.hand)
    observer: HapticSLAM | PoseOnly
    if "occupancy" in world.observation:
        observer = HapticSLAM(base.hand, particles=1, control_hz=base.control_hz, **told)
        stride = world.stride
    else:
        observer = PoseOnly(base.hand, control_hz=base.control_hz, stride=world.stride, **told)
        stride = 1
    coarse = {name: getattr(world, name) for name in ("variants", "samples", "temper")}
    candidates = None if world.shapes == FOUR else world.shapes
    shape = ShapePosterior(base.hand, candidates, stride=stride, **coarse, **vary)
    env = ObserverWrapper(DomainRandomisation(env, observer, world, held_out), observer, shape)
    env = DecisionReward(DecideWhenSure(env, world.threshold, world.sure_seconds), world.price, world.least)
    if world.observation != (RAW,):
        env = BeliefObservation(env, world.observation)
    return Monitor(InfoFilter(HoldAction(env, world.hold)))


def make_vector(world: TrainingWorld, count: int, jobs: int, held_out: bool = False) -> VecEnv:
    """Make environments side by side.

    Args:
        world: as `make_env`'s.
        count: E.
        jobs: 1: all in this process, else each in one of its own.
        held_out: as `make_env`'s.

    Returns:
        The environments as one.
    """
    makers: list[Maker] = [partial(make_env, world, held_out) for _ in range(count)]
    return in_processes(makers) if jobs > 1 else DummyVecEnv(makers)


def in_processes(makers: list[Maker]) -> SubprocVecEnv:
    """Make environments, each in a process that ignores Ctrl-C, which a terminal sends to all processes of a command
    and only this one is to heed, and that ends with this one, however this one ends.

    Args:
        makers: each makes one; they are pickled.

    Returns:
        The environments as one.
    """
    if "forkserver" in multiprocessing.get_all_start_methods():
        from multiprocessing import forkserver

        usual = signal.signal(signal.SIGINT, signal.SIG_IGN)  # what they are forked from, so that they are born so
        try:
            forkserver.ensure_running()
        finally:
            signal.signal(signal.SIGINT, usual)
    return SubprocVecEnv([partial(_in_worker, make) for make in makers])


def close(env: VecEnv) -> None:
    """End environments, in the middle of a step too: a worker may wait for a command whose beginning alone was sent.

    Args:
        env: of `make_vector`.
    """
    if not isinstance(env, SubprocVecEnv):
        env.close()
        return
    for process in env.processes:
        process.terminate()
    for process in env.processes:
        process.join()


def _in_worker(make: Maker) -> gym.Env[Any, Any]:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    return make()
