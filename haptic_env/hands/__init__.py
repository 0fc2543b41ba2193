"""The registry of hands: add one as a file here and a line in `HANDS`."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from haptic_env import validate
from haptic_env.hand import Hand
from haptic_env.hands import two_finger

HANDS: dict[str, Callable[..., Hand]] = {
    "two_finger": two_finger.make,
}


def make(name: str, **keywords: Any) -> Hand:
    """Build the hand `name`; raises `ValueError` for an unknown name or keyword."""
    build = HANDS[validate.choice("hand", name, HANDS)]
    validate.keywords(f"{name} hand", keywords, inspect.signature(build).parameters)
    return build(**keywords)
