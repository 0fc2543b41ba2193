"""What an object says of itself where Python shows it: one line, its class and what it was made of."""

from __future__ import annotations

import inspect
import reprlib
from pathlib import Path
from typing import Any

import numpy as np

LONGEST = 60  # characters of a value
FEW = 4  # of several values
LINE = 160  # characters of what an object was made of


class _Values(reprlib.Repr):
    """Values as they are, long ones by their beginning, arrays by their shape, hands and environments by their name."""

    def __init__(self) -> None:
        super().__init__()
        self.maxtuple = self.maxlist = self.maxset = self.maxfrozenset = self.maxdict = FEW
        self.maxstring = self.maxother = LONGEST

    def repr1(self, x: Any, level: int) -> str:
        if isinstance(x, np.generic):
            return super().repr1(x.item(), level)
        if isinstance(x, np.ndarray) and x.ndim:
            few = x.ndim == 1 and x.size <= FEW and x.dtype.kind in "biuf"
            return f"[{', '.join(f'{each:.4g}' for each in x.tolist())}]" if few else f"<{_times(x.shape)} array>"
        if isinstance(x, float):
            return f"{x:.6g}"
        if isinstance(x, Path):
            return super().repr1(str(x), level)
        if hasattr(x, "_fields"):  # a tuple with names of its own is one thing
            return self.repr_instance(x, level)
        return super().repr1(x, level)

    def repr_instance(self, x: Any, level: int) -> str:
        name = getattr(getattr(x, "spec", None), "id", None) or getattr(x, "name", None)
        if isinstance(name, str):
            return name
        if isinstance(x, type) or callable(x):
            return getattr(x, "__qualname__", type(x).__name__)
        told = repr(x)
        whole = "\n" not in told and " at 0x" not in told and len(told) <= LONGEST
        return told if whole else f"<{type(x).__name__}>"


VALUES = _Values()


def _times(shape: tuple[int, ...]) -> str:
    return " × ".join(map(str, shape))


def kept(of: object) -> list[str]:
    """List what an object was made of, as far as it keeps that.

    Args:
        of: any object.

    Returns:
        "name=value" of each argument of its class that is an attribute of it, but for those that are as usual.
    """
    told = []
    for name, parameter in inspect.signature(type(of)).parameters.items():
        value = getattr(of, name, None)
        usual = parameter.default
        if value is None or (isinstance(value, type(usual)) and not isinstance(value, np.ndarray) and value == usual):
            continue
        told.append(f"{name}={VALUES.repr(value)}")
    return told


def line(of: object) -> str:
    """Tell what an object is.

    Args:
        of: any object.

    Returns:
        Its class, and what it was made of, or the beginning of that.
    """
    told = ", ".join(kept(of))
    return f"{type(of).__name__}({told if len(told) <= LINE else f'{told[:LINE]}…'})"


def environment(of: Any) -> str:
    """Tell what an environment is.

    Args:
        of: an environment with a hand.

    Returns:
        Its class, its hand and how long it lasts.
    """
    return f"<{type(of).__name__} of {of.hand.name}: {of.episode_steps} steps at {of.control_hz:g} Hz>"


def millimetres(size: Any) -> str:
    """Tell lengths.

    Args:
        size: (3,) m.

    Returns:
        The same in millimetres.
    """
    return f"{' × '.join(f'{1e3 * each:.3g}' for each in size)} mm"
