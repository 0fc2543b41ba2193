"""Whose joints they are that a file, or a stream, has."""

from __future__ import annotations

from collections.abc import Collection
from functools import cache

from haptic_env import hands


def whose(names: Collection[str]) -> str:
    """Tell which hand of the registry has joints that are called so.

    Args:
        names: of columns, some of which may be no joints.

    Returns:
        What an error adds: of the hands all of whose joints are there, the one with most; "" where there is none.
    """
    fits = {name: len(joints) for name in hands.HANDS if {*(joints := _joints_of(name))} <= {*names} and joints}
    return f"; there are the joints of hand {max(fits, key=fits.__getitem__)!r}" if fits else ""


@cache
def _joints_of(name: str) -> tuple[str, ...]:
    """The joints of a hand; none where its model is not installed."""
    try:
        return tuple(hands.make(name).joint_names)
    except ImportError:
        return ()
