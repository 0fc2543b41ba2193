"""What is public says what it takes, what it returns, and what it raises."""

from __future__ import annotations

import importlib
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.properties.registry import MODULES
from tests.properties.test_registry import _names_of

NOTHING = (None, "None", "NoReturn", inspect.Signature.empty)


def functions_of(module: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """The functions that a module is for, and the methods of its classes, by name."""
    content = importlib.import_module(module)
    for name in _names_of(module):
        each = getattr(content, name)
        if not inspect.isclass(each):
            yield name, inspect.unwrap(getattr(each, "py_func", each))
            continue
        for method, found in vars(each).items():
            found = found.__func__ if isinstance(found, classmethod | staticmethod) else found
            made = method == "__init__" and not hasattr(each, "__dataclass_fields__")  # else attributes tell
            if inspect.isfunction(found) and (made or not method.startswith("_")):
                yield f"{name}.{method}", inspect.unwrap(found)


def lacking(function: Callable[..., Any]) -> list[str]:
    """Sections that the docstring of a function should have and has not."""
    told, signature = inspect.getdoc(function) or "", inspect.signature(function)
    wanted = {
        "Args:": bool(signature.parameters.keys() - {"self", "cls"}),
        "Returns:": signature.return_annotation not in NOTHING,
        "Raises:": bool(re.search(r"^\s+raise ", textwrap.dedent(inspect.getsource(function)), re.MULTILINE)),
    }
    given = told.replace("Yields:", "Returns:")
    return ["a docstring"] * (not told) + [
        name for name, is_wanted in wanted.items() if is_wanted and name not in given
    ]


@pytest.mark.parametrize("module", MODULES)
def test_what_is_public_says_what_it_takes_returns_and_raises(module: str) -> None:
    found = {name: lacking(function) for name, function in functions_of(module) if inspect.isfunction(function)}
    assert not {name: lacks for name, lacks in found.items() if lacks}


def test_what_is_not_said_is_found() -> None:
    def silent(value: int) -> int:
        """Add one."""
        if value < 0:
            raise ValueError(value)
        return value + 1

    assert lacking(silent) == ["Args:", "Returns:", "Raises:"]
    assert sum(len(list(functions_of(module))) for module in MODULES) > 200
