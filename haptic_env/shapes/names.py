"""What an object is called: a family of solids and, in brackets, its proportions and size.

`ellipsoid(1, 1, 1.3)`, `cube(size=0.04)`, `noise(7)`, and of a class of one's own `mypackage.shapes:Egg(0.3)`. A name
is read as literals and never run.
"""

from __future__ import annotations

import ast
import copy
import inspect
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from haptic_env import own, validate
from haptic_env.shapes.base import Shape

Families = Mapping[str, Callable[..., Shape]]
SIZE = "size"
NONE = "none"  # what is said of an object that is none of the candidates
LONGEST = 200  # letters


class Name(NamedTuple):
    """A name taken apart.

    Attributes:
        family: of the solid.
        values: of its parameters, in order.
        keywords: of the others, the size among them.
    """

    family: str
    values: tuple[Any, ...]
    keywords: tuple[tuple[str, Any], ...]

    def __str__(self) -> str:
        said = [*map(_said, self.values), *(f"{key}={_said(value)}" for key, value in self.keywords)]
        return f"{self.family}({', '.join(said)})" if said else self.family


def parsed(text: str) -> Name | None:
    """Take a name apart.

    Args:
        text: as a user gives it.

    Returns:
        The parts; None where it is no name with brackets, or holds anything but numbers in them.
    """
    if len(text) > LONGEST:
        return None
    text = text.strip()
    family = text.partition("(")[0].rstrip()
    if not own.is_named(family):
        return _parsed(text)
    rest = _parsed(f"own{text.removeprefix(family)}" if family != text else "own()")
    return None if rest is None else rest._replace(family=family)


def _parsed(text: str) -> Name | None:
    try:
        call = ast.parse(text, mode="eval").body
        if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name):
            return None
        values = tuple(ast.literal_eval(value) for value in call.args)
        pairs = [(each.arg, ast.literal_eval(each.value)) for each in call.keywords]
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return None
    named = tuple((key, value) for key, value in pairs if key is not None)
    numbers = all(map(_plain, values)) and all(_plain(value) for _, value in named)
    once = len({key for key, _ in named}) == len(pairs)
    return Name(call.func.id, values, named) if numbers and once else None


def signature(name: str, family: Callable[..., Shape]) -> str:
    """Show how a family is called.

    Args:
        name: of the family.
        family: makes its solids.

    Returns:
        The name with its parameters and their defaults.
    """
    takes = inspect.signature(family).parameters.values()
    said = ", ".join(
        each.name if each.default is inspect.Parameter.empty else f"{each.name}={_said(each.default)}" for each in takes
    )
    return f"{name}({said})"


@lru_cache(maxsize=256)  # one name, one object: what is drawn of a shape is kept by the object
def make(name: Name, family: Callable[..., Shape]) -> Shape:
    """Make the shape that a name says.

    Args:
        name: taken apart.
        family: that it is of.

    Returns:
        The shape, with the size that the name says as its default.

    Raises:
        ValueError: for parameters that the family does not have, or out of range.
    """
    given = dict(name.keywords)
    size = given.pop(SIZE, None)
    shown = validate.shown(str(name))
    try:
        inspect.signature(family).bind(*name.values, **given)
    except TypeError as error:
        valid = signature(name.family, family)
        raise ValueError(f"shape {shown}: {error}; say {valid}, or {SIZE}=metres besides") from None
    try:
        shape = family(*name.values, **given)
        return shape if size is None else _sized(shape, size)
    except ValueError as error:
        raise ValueError(f"shape {shown}: {error}") from error
    except Exception as error:  # of a class of a user's own, which may raise anything
        raise ValueError(f"shape {shown}: {type(error).__name__}: {error}") from error


def _sized(shape: Shape, size: Any) -> Shape:
    """A shape whose default size is another: (3,) m, or one number, its largest extent."""
    usual = np.asarray(shape.default_size)
    extents = usual * (size / usual.max()) if isinstance(size, int | float) else size
    sized = copy.copy(shape)
    x, y, z = shape.check_size(extents).tolist()
    sized.default_size = (x, y, z)
    return sized


def _plain(value: Any) -> bool:
    several = value if isinstance(value, tuple) else (value,)
    return all(isinstance(each, int | float) and not isinstance(each, bool) for each in several)


def _said(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_said, value))})"
    return f"{value:.12g}" if isinstance(value, float) else str(value)
