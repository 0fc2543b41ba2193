"""What a recording says of the exploration that it is played in, and flags that make no sense of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from haptic_env import shapes
from haptic_env.recordings import Recording
from haptic_lab import conditions, recorded
from haptic_lab.believed import BELIEVED
from haptic_lab.exploration import learnt
from haptic_lab.exploration.settings import DEFAULTS


def told_by(recording: Recording, given: Mapping[str, Any]) -> dict[str, Any]:
    """Tell what a recording says of the settings with which it is replayed.

    Args:
        recording: that is played.
        given: the flags, which win.

    Returns:
        Settings by name.

    Raises:
        ValueError: for flags that make no sense of a recording.
    """
    learnt.refuse(given)
    if recording.felt is not None:
        refuse_noise(given)
    if given["trust"]:
        shapes.allow(_names_in(recording))
    # A preset is all that is believed, of which the recording's single values are no part.
    kept = {*DEFAULTS, *learnt.JITTER} - (set() if given["believed"] is None else {*BELIEVED})
    told = {name: value for name, value in recording.settings.items() if name in kept}
    if given["env"] is None and "env" not in recording.settings:
        told["env"] = recorded.environment_of(recording)
    return told


def _names_in(recording: Recording) -> list[str]:
    """The shapes that a recording names."""
    told = recording.settings.get("object")
    names = recording.settings.get("shape"), told.get("name") if isinstance(told, dict) else None
    return [name for name in names if isinstance(name, str)]


def refuse_noise(given: Mapping[str, Any]) -> None:
    """Refuse noise where all that was felt is in a recording.

    Args:
        given: the flags.

    Raises:
        ValueError: for any.
    """
    for name in conditions.DEFAULTS:
        if given[name] is not None:
            flag = name.replace("_", "-")
            raise ValueError(
                f"--{flag} is for angles and contacts that are simulated, and this recording tells what was felt; what "
                f"observers believe of it is told by --believed-{flag} and the like"
            )


def refuse_exploring(wrist: str | None = None, policy: str | None = None) -> None:
    """Refuse what moves a hand that explores, where the hand does what was recorded.

    Args:
        wrist: of `--wrist`.
        policy: of `--policy`.

    Raises:
        ValueError: for either.
    """
    if wrist is not None:
        raise ValueError("--wrist is for a hand that explores, and a recording tells how its hand moved")
    if policy is not None:
        raise ValueError(f"--policy {policy}: a recording is replayed as it moved; take --policy out")
