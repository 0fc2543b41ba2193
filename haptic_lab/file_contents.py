"""What is in a file, by what reads it later; nothing that computes is loaded, so that a wrong file is told at once."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import suppress
from pathlib import Path

import numpy as np

from haptic_env import mesh_formats, reading, validate

BEGIN = {  # of files that need a library to be read
    ".parquet": (b"PAR1",),
    ".xdf": (b"XDF:",),
    ".zip": (b"PK\x03\x04", b"PK\x05\x06"),
}


def held(path: Path) -> Collection[str] | None:
    """Open a file as what its name says.

    Args:
        path: of the file.

    Returns:
        What is in it, told as `validate.plain` does: its keys, arrays or columns; None where there is no such thing.

    Raises:
        ValueError: where it is something else, in words that go on from its name.
        OSError: where it cannot be read.
    """
    suffix = path.suffix.lower()
    opened = OPENED.get(suffix)
    if opened is not None:
        there = opened(path)
        return None if there is None else [validate.plain(each) for each in there]
    if suffix in BEGIN:
        with path.open("rb") as file:
            if not file.read(8).startswith(BEGIN[suffix]):
                raise ValueError(f"is no {suffix[1:]} file: it does not begin as one")
    return None


def unknown(source: str, there: Collection[str], known: Collection[str]) -> str | None:
    """Look for a key that is none.

    Args:
        source: of the keys, for the message.
        there: the keys.
        known: those that may be there.

    Returns:
        What to say of the first; None: all may be there.
    """
    try:
        for each in there:
            validate.choice("key", each, known)
    except ValueError as error:
        return f"{source}: {error}"
    return None


def _toml(path: Path) -> Collection[str]:
    try:
        return reading.toml(path)
    except ValueError as error:
        raise ValueError(f"is no TOML file: {error}") from error


def _arrays(path: Path) -> Collection[str]:
    try:
        return list(reading.npz(path))
    except ValueError as error:
        raise ValueError(f"cannot be read: {str(error).removeprefix(f'{path}: ')}") from error


def _first_line(path: Path) -> str:
    try:
        lines = reading.text(path).splitlines()
    except ValueError as error:
        raise ValueError(f"cannot be read: {error}") from error
    for line in lines:
        if line.strip():
            return line
    raise ValueError("is empty")


def _columns(path: Path) -> Collection[str]:
    first = _first_line(path)
    separator = next((each for each in "\t,;" if each in first), ",")
    return [name.strip().strip('"') for name in first.split(separator)]


def _numbers(path: Path) -> None:
    first = _first_line(path)
    try:
        np.array(first.split(), dtype=float)
    except ValueError:
        raise ValueError(f"is no recording of a glove: it begins with {validate.shown(first)}") from None


def _mesh(path: Path) -> None:
    with suppress(ImportError):  # of faces with many corners; the command says what is to be installed
        mesh_formats.read(path)


OPENED: dict[str, Callable[[Path], Collection[str] | None]] = {
    ".csv": _columns,
    ".npz": _arrays,
    ".toml": _toml,
    ".tsv": _columns,
    ".txt": _numbers,
    **dict.fromkeys(mesh_formats.READERS, _mesh),
}
