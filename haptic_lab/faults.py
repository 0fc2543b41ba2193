"""Patches that do not work, as command lines, files and tables say them: 0.002, thumb_distal_tip or 3,7.

A number is the probability of each patch; anything else names patches, by names or indices with commas between. One
index is told from a number by the comma after it: `3,`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from haptic_env.sensors import Faults

FAULTS = ("patches_stuck", "patches_dead")  # keywords of environments and observers
HELP = "the probability of each patch, or patches by name or index with commas between (3 alone: 3,)"
Given = float | str | Sequence[int | str]


def as_faults(text: str | float) -> float | str:
    """Read faults from a command line, a file or a table.

    Args:
        text: as it was typed, or a number.

    Returns:
        The number that it is, or the patches as text, in which they are always the same.

    Raises:
        argparse.ArgumentTypeError: for a text that names nothing.
    """
    try:
        return float(text)
    except ValueError:
        patches = [each.strip() for each in str(text).split(",")]
    if len(patches) > 1 and not patches[-1]:
        patches.pop()
    if not all(patches):
        raise argparse.ArgumentTypeError(f"must be {HELP}, got {text!r}")
    return ",".join(patches) + ("," if len(patches) == 1 and _is_index(patches[0]) else "")


def as_keyword(given: Any) -> Faults:
    """Say faults as environments and observers are told them.

    Args:
        given: of `as_faults`, or what they are told; other values are theirs to refuse.

    Returns:
        The probability, or the patches: indices and names.

    Raises:
        ValueError: for a text that names nothing.
    """
    if not isinstance(given, str):
        told: Faults = given
        return told
    try:
        read = as_faults(given)
    except argparse.ArgumentTypeError as error:
        raise ValueError(f"patches {error}") from None
    if isinstance(read, float):
        return read
    return tuple(int(each) if _is_index(each) else each for each in read.removesuffix(",").split(","))


def _is_index(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) < 10
