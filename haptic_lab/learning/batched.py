"""Environments side by side in one process: threads step them, and they give what each gives alone, bit for bit.

Physics, pose filters and posteriors do not hold Python's lock while they run (`haptic_env.compiled`), so that threads
of one process are as good as processes, and nothing is copied between them. Seeds, autoreset and infos are those of the
classes of Gymnasium and Stable-Baselines3 that know of no threads: an environment has taken its step before they ask.

Shapes: E environments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from haptic_env import validate
from observer import threads as observer_threads

Maker = Callable[[], gym.Env[Any, Any]]


class StepAhead(gym.Wrapper, gym.utils.RecordConstructorArgs):
    """Takes a step, and resets where need be, before it is asked to, maybe on another thread."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        """Wrap an environment.

        Args:
            env: that is stepped ahead.
        """
        gym.utils.RecordConstructorArgs.__init__(self)
        gym.Wrapper.__init__(self, env)
        self.over = False
        self._stepped: Any = None
        self._begun: Any = None

    def ahead(self, action: Any, mode: AutoresetMode) -> None:
        """Do what will be asked for next.

        Args:
            action: of the environment.
            mode: when it is reset: at the step that ends an episode, or at the next one in place of a step.
        """
        self.forget()
        if mode == AutoresetMode.NEXT_STEP and self.over:
            self._begun, self.over = self.env.reset(), False
            return
        self._stepped = self.env.step(action)
        self.over = bool(self._stepped[2] or self._stepped[3])
        if mode == AutoresetMode.SAME_STEP and self.over:
            self._begun, self.over = self.env.reset(), False

    def forget(self) -> None:
        """Tell nothing of what was done ahead: somebody else's step failed, and this one will not be asked for."""
        self._stepped = self._begun = None

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        told, self._stepped = self._stepped, None
        return self.env.step(action) if told is None else told

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        told, self._begun = self._begun, None
        if told is not None:
            return told
        self._stepped, self.over = None, False
        return self.env.reset(seed=seed, options=options)


def step_ahead(make: Maker) -> StepAhead:
    """Make an environment that can be stepped ahead.

    Args:
        make: makes one.

    Returns:
        The environment.
    """
    return StepAhead(make())


class Crew:
    """Threads that step environments, asleep until there is a step."""

    def __init__(self, environments: Sequence[Any], threads: int | None) -> None:
        """Put environments side by side.

        Args:
            environments: E of them, each in a `StepAhead`.
            threads: how many; None: one a core, `observer.threads.limit` at most.

        Raises:
            ValueError: for no such number.
        """
        chosen = observer_threads.chosen(observer_threads.check(threads), len(environments), 2.0)
        self.threads = min(chosen, len(environments))
        self._environments, self._closed = environments, False
        self._pool = ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None

    def ahead(self, actions: Iterable[Any], mode: AutoresetMode) -> None:
        """Let each environment do what will be asked of it next.

        Where one fails, the others end their steps, and what these gave is forgotten: a reset is a reset.

        Args:
            actions: E of them.
            mode: as `StepAhead.ahead`'s.

        Raises:
            ValueError: for another number of actions, and as the environments.
            RuntimeError: after `close`.
        """
        if self._closed:
            raise RuntimeError("the environments are closed; make new ones")
        told, count = list(actions), len(self._environments)
        if len(told) != count:
            raise ValueError(f"actions must be {count}, one for each environment, got {len(told)}")
        turns = iter(list(zip(self._environments, told, strict=True)))
        others = [self._pool.submit(_work, turns, mode) for _ in range(self.threads - 1)] if self._pool else []
        try:
            try:
                _work(turns, mode)
            finally:
                wait(others)
            for other in others:
                other.result()
        except BaseException:
            for env in self._environments:
                env.forget()
            raise

    def close(self) -> None:
        """End the threads."""
        self._closed = True
        if self._pool is not None:
            self._pool.shutdown()


def _work(turns: Iterator[tuple[Any, Any]], mode: AutoresetMode) -> None:
    for env, action in turns:
        env.ahead(action, mode)


class ThreadedVectorEnv(SyncVectorEnv):
    """Gymnasium's `SyncVectorEnv`, but for threads that step the environments side by side.

    An episode's end is followed by a reset at the next step (`AutoresetMode.NEXT_STEP`), unless another mode is asked
    for, as its metadata say.
    """

    def __init__(self, env_fns: Sequence[Maker], threads: int | None = None, **keywords: Any) -> None:
        """Make the environments.

        Args:
            env_fns: each makes one.
            threads: how many step them; None: one a core.
            **keywords: of `SyncVectorEnv`, such as `autoreset_mode`.

        Raises:
            ValueError: for no such number of threads.
        """
        super().__init__([partial(step_ahead, make) for make in env_fns], **keywords)
        self.crew = Crew(self.envs, threads)

    def step(self, actions: Any) -> Any:
        """Take a step of each environment.

        Args:
            actions: (E, …), a batch of `action_space`.

        Returns:
            What `SyncVectorEnv.step` gives.

        Raises:
            ValueError: for actions of another shape, and as the environments.
            RuntimeError: after `close`.
        """
        if isinstance(self.action_space, gym.spaces.Box) and np.shape(actions) != self.action_space.shape:
            raise ValueError(
                f"actions must be of shape {self.action_space.shape}, a row for each environment, got "
                f"{validate.shown(actions)} of shape {np.shape(actions)}"
            )
        self.crew.ahead(gym.vector.utils.iterate(self.action_space, actions), self.autoreset_mode)
        return super().step(actions)

    def close_extras(self, **keywords: Any) -> None:
        """End threads and environments.

        Args:
            **keywords: of `SyncVectorEnv`.
        """
        self.crew.close()
        super().close_extras(**keywords)
