"""Modules and classes under the names that they had before: kept for one release, with a `DeprecationWarning`."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any


class _Moved(MetaPathFinder, Loader):
    """Finds modules that are no longer there: each is a view of those that hold its content now."""

    def __init__(self) -> None:
        self.homes: dict[str, tuple[str, ...]] = {}

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> Any:
        return ModuleSpec(fullname, self) if fullname in self.homes else None

    def exec_module(self, module: ModuleType) -> None:
        homes = self.homes[module.__name__]

        def content(name: str) -> Any:
            for home in homes:
                found = importlib.import_module(home)
                if not name.startswith("__") and hasattr(found, name):
                    return getattr(found, name)
            raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}")

        vars(module)["__getattr__"] = content
        warnings.warn(
            f"{module.__name__} is {' and '.join(homes)} now; the old name goes with the next release",
            DeprecationWarning,
            stacklevel=2,
        )


_FINDER = _Moved()


def moved(homes: Mapping[str, Sequence[str]]) -> None:
    """Keep importable what was moved.

    Args:
        homes: by the old name of each module, the names of those that hold its content.
    """
    if _FINDER not in sys.meta_path:
        sys.meta_path.append(_FINDER)
    _FINDER.homes.update({old: tuple(new) for old, new in homes.items()})


def renamed(module: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """A `__getattr__` for `module`, which keeps what it holds importable under its old `names`.

    Args:
        module: name of the module.
        names: by the old name of each thing, the one that it has now, after that of its module if it moved.

    Returns:
        What Python asks for names that the module lacks.
    """

    def content(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        warnings.warn(
            f"{module}.{name} is {names[name]} now; the old name goes with the next release",
            DeprecationWarning,
            stacklevel=2,
        )
        home, _, new = names[name].rpartition(".")
        return getattr(importlib.import_module(home or module), new)

    return content
