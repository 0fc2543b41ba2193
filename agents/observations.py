"""What a policy is shown: an observation, or one for each of several environments, stacked as in Stable-Baselines3."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import gymnasium as gym

from haptic_env import validate

MOST = 2**16  # environments side by side


def count(observation: Any, space: gym.Space[Any] | None) -> int | None:
    """Count the environments that an observation is of.

    Args:
        observation: of one, or of several stacked.
        space: of one; None: any.

    Returns:
        How many are stacked; None: it is of one, not stacked.

    Raises:
        ValueError: for more than `MOST`.
    """
    for name, value, each in _entries(observation, space):
        given = validate.real(value)
        shape = () if given is None else given.shape
        if each.shape is not None and len(shape) == len(each.shape) + 1 and shape[1:] == each.shape:
            if shape[0] > MOST:
                raise ValueError(f"{name} must be of {MOST} environments at most, got {shape[0]}")
            return shape[0]
    return None


def row(observation: Any, index: int) -> Any:
    """Take the observation of one environment.

    Args:
        observation: of several stacked.
        index: of the environment.

    Returns:
        Its observation.
    """
    if isinstance(observation, Mapping):
        return {name: each[index] for name, each in observation.items()}
    return observation[index]


def check(observation: Any, space: gym.Space[Any] | None) -> None:
    """Check an observation.

    Args:
        observation: of one environment.
        space: whose entries and shapes it must have; None: any.

    Raises:
        ValueError: for other entries or shapes, and numbers that are not finite.
    """
    if isinstance(space, gym.spaces.Dict):
        given = list(observation) if isinstance(observation, Mapping) else None
        if given is None or not set(space) <= set(given):
            got = observation if given is None else given
            raise ValueError(f"an observation must have the entries {', '.join(space)}, got {validate.shown(got)}")
    for name, value, each in _entries(observation, space):
        if isinstance(each, gym.spaces.MultiBinary):
            validate.binary(name, value, each.shape)
        elif isinstance(each, gym.spaces.Box):
            validate.array(name, value, each.shape)


def _entries(observation: Any, space: gym.Space[Any] | None) -> Iterator[tuple[str, Any, gym.Space[Any]]]:
    """Name, value and space of each part of `observation` that `space` tells of; None tells of nothing."""
    if space is None:
        return
    if not isinstance(space, gym.spaces.Dict):
        yield "an observation", observation, space
    elif isinstance(observation, Mapping):
        for name, each in space.items():
            if name in observation:
                yield f"{name} of an observation", observation[name], each
