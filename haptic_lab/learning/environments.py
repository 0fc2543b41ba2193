"""What a learner of Stable-Baselines3 explores: a world as `explored` makes it, one or several side by side."""

from __future__ import annotations

import multiprocessing
import signal
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

from haptic_lab.learning.batched import Maker
from haptic_lab.learning.batched_learners import ThreadedVecEnv
from haptic_lab.learning.explored import explored
from haptic_lab.learning.presets import TrainingWorld
from haptic_lab.processes import end_with_parent
from observer import threads

MOST_THREADS = 4  # more would wait for Python's lock, a fifth of the time of a step


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
    return Monitor(InfoFilter(explored(world, held_out)))


def make_vector(world: TrainingWorld, count: int, jobs: int, held_out: bool = False) -> VecEnv:
    """Make environments side by side.

    Args:
        world: as `make_env`'s.
        count: E.
        jobs: threads of this process that step them; above `MOST_THREADS` each is in a process of its own.
        held_out: as `make_env`'s.

    Returns:
        The environments as one.
    """
    makers: list[Maker] = [partial(make_env, world, held_out) for _ in range(count)]
    return in_processes(makers) if jobs > MOST_THREADS else ThreadedVecEnv(makers, jobs)


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
    threads.limit(1)
    return make()
