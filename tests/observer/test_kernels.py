"""What belongs together travels together: kernels take a few named tuples."""

from __future__ import annotations

import importlib
import inspect
import pkgutil

import agents
import haptic_env
import observer
from haptic_env.compiled import KERNELS

MOST = 8  # arguments
MORE = {"haptic_env.touch._touch"}  # whose arguments are not yet told together


def test_no_kernel_takes_many_arguments() -> None:
    for package in (haptic_env, observer, agents):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            importlib.import_module(module.name)
    functions = [kernel.py_func for kernel in KERNELS if kernel.py_func.__module__.partition(".")[0] != "made"]
    taken = {f"{each.__module__}.{each.__qualname__}": len(inspect.signature(each).parameters) for each in functions}
    assert len(taken) > 50
    assert {name for name, count in taken.items() if count > MOST} - MORE == set()
