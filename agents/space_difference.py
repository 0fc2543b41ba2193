"""How two spaces of observations or actions differ, in a line that a person can act on."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from haptic_env import validate


def difference(trained: gym.Space[Any], here: gym.Space[Any]) -> str:
    """Tell how two spaces differ, by their entries, kinds and shapes rather than by all of their bounds.

    Args:
        trained: what a model was trained with.
        here: what it would be used with.

    Returns:
        One line; "" where they are the same.
    """
    if trained == here:
        return ""
    if isinstance(trained, spaces.Dict) and isinstance(here, spaces.Dict):
        missing, more = (
            [f"{name} {brief(space.spaces[name])}" for name in space.spaces if name not in other.spaces]
            for space, other in ((trained, here), (here, trained))
        )
        shared = [name for name in trained.spaces if name in here.spaces]
        told = [f"{', '.join(missing)} missing here"] if missing else []
        told += [f"{', '.join(more)} here and not there"] if more else []
        differ = ((name, difference(trained.spaces[name], here.spaces[name])) for name in shared)
        told += [f"{name}: {what}" for name, what in differ if what]
        return "; ".join(told) or "its entries are in another order here"
    if brief(trained) != brief(here):
        return f"{brief(trained)}, and here {brief(here)}"
    if isinstance(trained, spaces.Box) and isinstance(here, spaces.Box):
        for bound in ("low", "high"):
            there, now = (np.asarray(getattr(each, bound)) for each in (trained, here))
            wrong = np.argwhere(there != now)
            if len(wrong):
                at = tuple(int(i) for i in wrong[0])
                where = f" at index {at[0] if len(at) == 1 else at}" if at else ""
                return f"{brief(trained)} with {bound} {there[at]:g}{where}, and here {now[at]:g}"
    return f"{brief(trained)} that are not the same here"


def brief(space: gym.Space[Any]) -> str:
    """Tell what a space is without its bounds.

    Args:
        space: of any kind.

    Returns:
        Kind and shape, and of a Dict its entries.
    """
    if isinstance(space, spaces.Dict):
        return f"Dict({', '.join(f'{name}: {brief(each)}' for name, each in space.spaces.items())})"
    if isinstance(space, spaces.Box):
        return f"Box{space.shape} {space.dtype}"
    if isinstance(space, spaces.MultiBinary):
        return f"MultiBinary{space.shape}"
    return validate.shown(space)
