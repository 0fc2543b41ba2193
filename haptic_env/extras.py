"""Packages that only some users need, imported where they are used."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any


def folder(module: str, extra: str, what: str) -> Path:
    """Where the package `module` lies that `what` needs; raises `ImportError` that says which `extra` to install where
    it is missing. The package is not imported."""
    found = importlib.util.find_spec(module)
    if found is None or found.origin is None:
        raise ImportError(f"{what} needs the package {module!r}: pip install 'haptic-slam[{extra}]'")
    return Path(found.origin).parent


def load(module: str, extra: str, what: str) -> Any:
    """The same, imported."""
    folder(module, extra, what)
    return importlib.import_module(module)
