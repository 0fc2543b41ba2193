"""Packages that only some users need, imported where they are used."""

from __future__ import annotations

import importlib
from typing import Any


def load(module: str, extra: str, what: str) -> Any:
    """The `module` that `what` needs; raises `ImportError` that says which `extra` to install where it is missing."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != module.split(".")[0]:
            raise
        raise ImportError(f"{what} needs the package {module!r}: pip install 'haptic-slam[{extra}]'") from error
