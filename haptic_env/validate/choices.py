"""Checks of names: of what there is to choose from, and of keyword arguments."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Any

from haptic_env.validate.wording import QUOTED, shown


def choice(what: str, value: Any, valid: Collection[str]) -> str:
    """Check that a value is one of several.

    Args:
        what: the value is, for the message.
        value: that was given.
        valid: what there is to choose from.

    Returns:
        The value.

    Raises:
        ValueError: for another value; it lists the valid ones, and the nearest first.
    """
    if isinstance(value, str) and value in valid:
        return value
    near = difflib.get_close_matches(value[:QUOTED], valid, n=1) if isinstance(value, str) else []
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    raise ValueError(f"unknown {what} {shown(value)}{hint}; choose from {', '.join(sorted(valid)) or 'none at all'}")


def names(what: str, value: Any) -> tuple[str, ...]:
    """Check that a value is names one after the other.

    Args:
        what: the value is, for the message.
        value: that was given.

    Returns:
        The names, one at least.

    Raises:
        ValueError: for anything else, a single text included.
    """
    several = isinstance(value, Sequence) and not isinstance(value, str)
    if not several or not value or not all(isinstance(each, str) for each in value):
        raise ValueError(f"{what} must be one name or more, got {shown(value)}")
    return tuple(value)


def keywords(what: str, given: Iterable[str], valid: Collection[str]) -> None:
    """Check the names of keyword arguments.

    Args:
        what: takes them, for the message.
        given: their names.
        valid: what it takes.

    Raises:
        ValueError: at the first that it does not take.
    """
    for name in given:
        choice(f"{what} keyword", name, valid)


def keywords_of(function: Callable[..., Any]) -> list[str]:
    """List the arguments that a function or class takes by keyword alone.

    Args:
        function: with a signature.

    Returns:
        Their names, in order.
    """
    parameters = inspect.signature(function).parameters.values()
    return [each.name for each in parameters if each.kind is inspect.Parameter.KEYWORD_ONLY]
