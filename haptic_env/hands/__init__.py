"""The registry of hands: add one as a file here and a line in `HANDS`; or describe one's own in a TOML file."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from haptic_env import validate
from haptic_env.hand import Hand
from haptic_env.hands import adroit, myo, own, two_finger
from haptic_env.registration import is_file

HANDS: dict[str, Callable[..., Hand]] = {
    "two_finger": two_finger.make,
    "two_finger_arm": two_finger.make_arm,
    "adroit": adroit.make,
    "myo": myo.make,
}
OWN = "a TOML file that describes one's own"


def make(name: str | Path, **keywords: Any) -> Hand:
    """Build a hand.

    Args:
        name: in `HANDS`, or the path of a TOML file (`haptic_env.hands.description`).
        **keywords: of that hand, as `keywords_of` lists them.

    Returns:
        The hand.

    Raises:
        ValueError: for an unknown name or keyword, and what is wrong in a file.
    """
    validate.keywords(f"{name} hand", keywords, keywords_of(name))
    return own.make(name, **keywords) if is_file(name) else HANDS[str(name)](**keywords)


def keywords_of(name: str | Path) -> tuple[str, ...]:
    """List the keywords that a hand takes.

    Args:
        name: in `HANDS`, or the path of a TOML file.

    Returns:
        The names of the keywords.

    Raises:
        ValueError: for an unknown name.
    """
    if is_file(name):
        return tuple(inspect.signature(own.make).parameters)[1:]
    return tuple(inspect.signature(HANDS[check("hand", name)]).parameters)


def check(what: str, name: Any) -> str:
    """Check what names a hand.

    Args:
        what: the value is, for the message.
        name: that was given.

    Returns:
        The name, in `HANDS`, or the path of a TOML file, whatever is in it.

    Raises:
        ValueError: for another value.
    """
    if is_file(name):
        return str(validate.path(what, name))
    try:
        return validate.choice(what, name, HANDS)
    except ValueError as error:
        raise ValueError(f"{error}, or {OWN}") from None
