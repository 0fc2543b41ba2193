"""Environments side by side in one process, as Stable-Baselines3 has them (`haptic_lab.learning.batched`)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import DummyVecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from haptic_lab.learning.batched import Crew, Maker, step_ahead


class ThreadedVecEnv(DummyVecEnv):
    """Stable-Baselines3's `DummyVecEnv`, but for threads that step the environments side by side.

    The step that ends an episode gives the observation of the next one; the last one is `terminal_observation` of its
    info.
    """

    def __init__(self, env_fns: Sequence[Maker], threads: int | None = None) -> None:
        """Make the environments.

        Args:
            env_fns: each makes one.
            threads: how many step them; None: one a core.

        Raises:
            ValueError: for no such number of threads.
        """
        super().__init__([partial(step_ahead, make) for make in env_fns])
        self.crew = Crew(self.envs, threads)

    def step_wait(self) -> VecEnvStepReturn:
        """Take a step of each environment, with the actions of `step_async`.

        Returns:
            What `DummyVecEnv.step_wait` gives.
        """
        self.crew.ahead(self.actions, AutoresetMode.SAME_STEP)
        return super().step_wait()

    def close(self) -> None:
        """End threads and environments."""
        self.crew.close()
        super().close()
