"""Packages that only some users need, imported where they are used."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any


def folder(module: str, extra: str, what: str) -> Path:
    """Find where the package `module` lies, without importing it.

    Args:
        module: name of the package.
        extra: the extra of this project that installs it, for the error.
        what: what needs it, for the error.

    Returns:
        The package's folder.

    Raises:
        ImportError: where it is missing, with the `extra` to install.
    """
    found = importlib.util.find_spec(module)
    if found is None or found.origin is None:
        raise ImportError(f"{what} needs the package {module!r}: pip install 'haptic-slam[{extra}]'")
    return Path(found.origin).parent


def load(module: str, extra: str, what: str) -> Any:
    """Import the package `module`.

    Args:
        module: name of the package.
        extra: the extra of this project that installs it, for the error.
        what: what needs it, for the error.

    Returns:
        The module.

    Raises:
        ImportError: where it is missing, with the `extra` to install.
    """
    folder(module, extra, what)
    return importlib.import_module(module)
