"""Packages that only some users need, imported where they are used."""

from __future__ import annotations

import importlib.util
import json
from importlib import metadata
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

PROJECT = "haptic-slam"


def how_to_install(extra: str) -> str:
    """Say how an extra is installed, of the checkout that this comes from or, where there is none, by name.

    Args:
        extra: of this project.

    Returns:
        A line for the shell.
    """
    place, editable = _checkout()
    named = PROJECT if place is None else "." if place == Path.cwd() else str(place)
    return f"pip install {'-e ' if editable else ''}'{named}[{extra}]'"


def _checkout() -> tuple[Path | None, bool]:
    """Where the sources are that this was installed from, if they are there, and whether they are what runs."""
    here = Path(__file__).resolve().parents[1]
    if (here / "pyproject.toml").is_file():
        return here, True
    try:
        told = json.loads(metadata.distribution(PROJECT).read_text("direct_url.json") or "{}")
        place = Path(url2pathname(urlsplit(told["url"]).path)) if "dir_info" in told else None
    except (metadata.PackageNotFoundError, ValueError, KeyError, TypeError):
        return None, False
    return (place if place is not None and (place / "pyproject.toml").is_file() else None), False


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
        raise ImportError(f"{what} needs the package {module!r}: {how_to_install(extra)}")
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
