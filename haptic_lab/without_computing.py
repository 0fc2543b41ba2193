"""Commands loaded without the packages that compute, for what they only say of themselves.

What `--help` tells of shapes, policies and observers stands in their registries, which load whatever computes with
them. Here empty stand-ins take the place of those packages, so that the registries are there in a fraction of the time.
A process that has loaded them so cannot compute any more.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import FunctionType, ModuleType
from typing import Any

HEAVY = frozenset(
    ("PIL", "dm_control", "gymnasium", "joblib", "llvmlite", "matplotlib", "mpl_toolkits", "mujoco", "numba", "pandas")
    + ("pyarrow", "scipy", "sklearn", "stable_baselines3", "threadpoolctl", "torch")
)
OUR_OWN = frozenset(("haptic_env.compiled", "haptic_env.kernel_cache"))  # that compile, and say for which machine


def begin() -> None:
    """Let stand-ins take the place of `HEAVY` from now on; where some are loaded already, they are what is there."""
    if HEAVY.isdisjoint(sys.modules):
        sys.meta_path.insert(0, _Finder())


class _Anything:
    """Is whatever a module does with a package while it is loaded: called, subclassed, put into types and sums."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _Anything()

    def __call__(self, *arguments: Any, **keywords: Any) -> Any:
        decorates = len(arguments) == 1 and not keywords and isinstance(arguments[0], FunctionType | type)
        return arguments[0] if decorates else _Anything()

    def __mro_entries__(self, bases: tuple[Any, ...]) -> tuple[type, ...]:
        return ()

    def __or__(self, other: Any) -> Any:
        return self

    __ror__ = __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __or__
    __getitem__ = __or__

    def __iter__(self) -> Iterator[Any]:
        return iter(())

    def __len__(self) -> int:
        return 0

    def __int__(self) -> int:
        return 0

    def __index__(self) -> int:
        return 0

    def __float__(self) -> float:
        return 0.0

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        pass


class _StandIn(ModuleType):
    __version__ = "0"
    __path__: list[str] = []  # noqa: RUF012 - as of any package

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _Anything()


class _Finder(MetaPathFinder, Loader):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname.partition(".")[0] in HEAVY or fullname in OUR_OWN:
            return ModuleSpec(fullname, self, is_package=True)
        return None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _StandIn(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        pass
