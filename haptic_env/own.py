"""Classes of a user's own, named "module:Class".

A name never imports anything by itself: it may come out of a file that somebody hands over. `find` looks among what is
imported already, and `load` is for names that the user has typed, or has said to trust.
"""

from __future__ import annotations

import importlib
import os
import re
import sys
from typing import TypeVar

from haptic_env import validate

T = TypeVar("T")

NAMED = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*(\.[^\W\d]\w*)*")


def is_named(name: str) -> bool:
    """Tell whether a name is that of a class of a user's own.

    Args:
        name: any text.

    Returns:
        Whether it is "module:Class".
    """
    return NAMED.fullmatch(name) is not None


def load(what: str, name: str) -> None:
    """Import the module of a class, which runs what is in it; it is sought where Python seeks them, and in the folder
    that one is in.

    Args:
        what: the class is, for messages.
        name: "module:Class".

    Raises:
        ValueError: where it cannot be imported.
    """
    module = name.partition(":")[0]
    here = os.getcwd()
    if here not in sys.path and "" not in sys.path:
        sys.path.append(here)  # where `python -m` looks too; last, so that it hides nothing
    try:
        importlib.import_module(module)
    except (Exception, SystemExit) as error:  # whatever a user's code may raise
        raise ValueError(
            f"{what} {validate.shown(name)}: the module {module} cannot be imported: {type(error).__name__}: {error}"
        ) from error


def find(what: str, name: str, kind: type[T]) -> type[T]:
    """Find a class in a module that is imported already.

    Args:
        what: the class is, for messages.
        name: "module:Class".
        kind: that it must be of.

    Returns:
        The class.

    Raises:
        ValueError: where the module is not imported, or has no such class of that kind.
    """
    module, _, path = name.partition(":")
    if module not in sys.modules:
        raise ValueError(
            f"{what} {validate.shown(name)} is of a module that is not imported, and a name alone runs no code: import "
            f"{module} first, or type the name itself at a command; for names in files of those whom you trust, --trust"
        )
    found: object = sys.modules[module]
    for part in path.split("."):
        found = getattr(found, "__dict__", {}).get(part)  # no attribute that would import something when asked for
    if not (isinstance(found, type) and issubclass(found, kind)):
        valid = [each for each, made in vars(sys.modules[module]).items() if _is_own(made, kind, module)]
        told = f"; choose from {', '.join(f'{module}:{each}' for each in valid)}" if valid else ""
        raise ValueError(f"{what} {validate.shown(name)} is no class of the kind {kind.__name__} there{told}")
    return found


def _is_own(made: object, kind: type, module: str) -> bool:
    return isinstance(made, type) and issubclass(made, kind) and made.__module__ == module
