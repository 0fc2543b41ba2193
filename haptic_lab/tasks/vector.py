"""Environments of a task side by side, on threads of one process: what `gym.make_vec` makes of its id."""

from __future__ import annotations

from functools import partial
from typing import Any

from haptic_env import validate
from haptic_lab.learning.batched import ThreadedVectorEnv
from haptic_lab.tasks.environment import TaskEnv


def make_vector(num_envs: int, task: str, **keywords: Any) -> ThreadedVectorEnv:
    """Make environments of a task, each with what it gives alone.

    Args:
        num_envs: E.
        task: as `TaskEnv`'s.
        **keywords: likewise.

    Returns:
        The environments as one.

    Raises:
        ValueError: for no such number of environments, and as `TaskEnv`.
    """
    count = validate.integer("num_envs", num_envs, 1, 1024)
    return ThreadedVectorEnv([partial(TaskEnv, task, **keywords)] * count)
