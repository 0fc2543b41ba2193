"""Files that are not there, found before a command is loaded, which takes seconds."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence

ENDINGS = (".csv", ".npz", ".obj", ".parquet", ".pkl", ".ply", ".stl", ".toml", ".tsv", ".txt", ".xdf", ".zarr", ".zip")
FLAGS = frozenset(
    ("--columns", "--config", "--courses", "--glove-calibration", "--hand", "--normalize", "--objects", "--policies")
    + ("--policy", "--recording", "--recordings", "--shape", "--shapes", "--trial-table")
)  # not --mesh: where there is no such file it is written
ALWAYS = frozenset(("--columns", "--config", "--glove-calibration", "--recording"))  # of which no value is a name
ALONE = (
    "check-hand",
    "compare",
    "export",
    "fit",
    "people",
    "replay",
    "study",
)  # commands of which a file is told without a flag


def first_missing(command: str, arguments: Sequence[str]) -> str | None:
    """Find the first file that is to be read and is not there.

    What is not plainly a file, a name say, or lies in a place that cannot be told from here, is left to the command.

    Args:
        command: of `haptic_lab.cli.COMMANDS`.
        arguments: of its command line.

    Returns:
        What to say of it; None where there is none.
    """
    for flag, value in _values(command, arguments):
        is_file = flag in ALWAYS or (command == "replay" and not flag) or value.lower().endswith(ENDINGS)
        if value.strip() and is_file and not os.path.lexists(os.path.expanduser(value)):
            return f"{flag + ': ' if flag else ''}there is no file {value!r}"
    return None


def _values(command: str, arguments: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Flags that name files, each with a value; the flag is empty for what stands before any."""
    flag = ""
    for each in arguments:
        if each.startswith("--"):
            flag, equals, value = each.partition("=")
            if equals and flag in FLAGS:
                yield flag, value
        elif flag in FLAGS or (not flag and command in ALONE):
            yield flag, each
