"""The registry of hands: add one as a file here and a line in `HANDS`."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from haptic_env import validate
from haptic_env.hand import Hand
from haptic_env.hands import adroit, myo, two_finger

HANDS: dict[str, Callable[..., Hand]] = {
    "two_finger": two_finger.make,
    "two_finger_arm": two_finger.make_arm,
    "adroit": adroit.make,
    "myo": myo.make,
}


def make(name: str, **keywords: Any) -> Hand:
    """Build a hand.

    Args:
        name: in `HANDS`.
        **keywords: of that hand, as `keywords_of` lists them.

    Returns:
        The hand.

    Raises:
        ValueError: for an unknown name or keyword.
    """
    validate.keywords(f"{name} hand", keywords, keywords_of(name))
    return HANDS[name](**keywords)


def keywords_of(name: str) -> tuple[str, ...]:
    """List the keywords that a hand takes.

    Args:
        name: in `HANDS`.

    Returns:
        The names of the keywords.

    Raises:
        ValueError: for an unknown name.
    """
    return tuple(inspect.signature(HANDS[validate.choice("hand", name, HANDS)]).parameters)
