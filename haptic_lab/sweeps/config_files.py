"""TOML files that stand for the flags of a sweep: each value of the type that its flag has."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from haptic_env import reading, validate
from haptic_lab import believed, faults
from haptic_lab.terminal import as_path
from haptic_lab.worlds import as_shape, typed_shape

Options = Mapping[str, argparse.Action]
KINDS: dict[Any, str] = {
    bool: "true or false",
    int: "an integer",
    float: "a number",
    str: "a string",
    believed.as_sigma: f"a number or {believed.UNKNOWN!r}",
    faults.as_faults: "a number, or patches as a string",
}
ALSO = {"repeats": "trials"}  # another word for a key


def read(path: Path, options: Options) -> dict[str, Any]:
    """Read the file of --config.

    Args:
        path: of the TOML file.
        options: of `make_parser`.

    Returns:
        What it sets, each of the right type; raises `ValueError` for another one, and `OSError`.
    """
    return typed(reading.toml(path), options)


def typed(values: Mapping[str, Any], options: Options) -> dict[str, Any]:
    """Check what stands in a file.

    Args:
        values: by key.
        options: of `make_parser`.

    Returns:
        The values, each of the right type.

    Raises:
        ValueError: for a key that is none, and a value of another type.
    """
    told = {ALSO.get(name, name): value for name, value in values.items()}
    return {name: _typed(name, value, options) for name, value in told.items()}


def _typed(name: str, value: Any, options: Options) -> Any:
    option = options[validate.choice("key", name, options)]
    kind: Any = bool if isinstance(option, argparse.BooleanOptionalAction) else option.type
    kind = kind if kind in KINDS else str
    several = option.nargs in ("+", "*")
    values = value if several and isinstance(value, list) else [value]
    if not all(_is(kind, each) for each in values):
        raise ValueError(f"{name} must be {KINDS[kind]}{' or a list of such' if several else ''}, got {value!r}")
    try:
        values = [_read_as(option, kind, each) for each in values]
    except argparse.ArgumentTypeError as error:
        raise ValueError(f"{name} {error}") from error
    except OverflowError as error:
        raise ValueError(f"{name} must be {KINDS[kind]} that a float can be, got {values!r}") from error
    return values if several else values[0]


def _read_as(option: argparse.Action, kind: Any, value: Any) -> Any:
    """A value of a file as that of a flag; names in a file import nothing."""
    if option.type is typed_shape:
        return as_shape(value)
    return as_path(value) if option.type is as_path else kind(value)


def _is(kind: Any, value: Any) -> bool:
    """Whether a value of a file is of a kind of `KINDS`."""
    if kind is believed.as_sigma:
        return _is(float, value) or value == believed.UNKNOWN
    if kind is faults.as_faults:
        return _is(float, value) or _is(str, value)
    return type(value) is kind or (kind is float and type(value) is int)
