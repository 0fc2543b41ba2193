"""Environments of a task side by side, on threads of one process: what `gym.make_vec` makes of its id."""

from __future__ import annotations

from functools import partial
from typing import Any

from gymnasium.vector import AutoresetMode

from haptic_env import validate
from haptic_lab.learning.batched import ThreadedVectorEnv
from haptic_lab.tasks.environment import TaskEnv


def make_vector(
    num_envs: int, task: str, *, autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP, **keywords: Any
) -> ThreadedVectorEnv:
    """Make environments of a task, each with what it gives alone.

    Args:
        num_envs: E.
        task: as `TaskEnv`'s.
        autoreset_mode: one of `gymnasium.vector.AutoresetMode`: when an environment whose episode is over is reset.
        **keywords: likewise.

    Returns:
        The environments as one.

    Raises:
        ValueError: for no such number of environments, or no such mode, and as `TaskEnv`.
    """
    count = validate.integer("num_envs", num_envs, 1, 1024)
    told = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
    mode = AutoresetMode(validate.choice("autoreset_mode", told, [each.value for each in AutoresetMode]))
    return ThreadedVectorEnv([partial(TaskEnv, task, **keywords)] * count, autoreset_mode=mode)
