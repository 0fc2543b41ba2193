"""What an exploration has found of the hand's own senses: offsets of felt angles, and patches that lie."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from haptic_lab.exploration import offsets, patches
from haptic_lab.exploration.settings import ExplorationSettings
from haptic_lab.records import BeliefTrace, Exploration


def found(settings: ExplorationSettings, exploration: Exploration, trace: BeliefTrace) -> dict[str, Any]:
    """Say what was found.

    Args:
        settings: of the exploration.
        exploration: what happened.
        trace: what the observer believed.

    Returns:
        `joint_offset` and `patches`, each where the observer believed that there might be something to find.
    """
    told = {
        "joint_offset": offsets.found(exploration, trace),
        "patches": patches.found(exploration, trace, settings.believed_noise),
    }
    return {name: each for name, each in told.items() if each}


def tell(console: Console, summary: Mapping[str, Any]) -> None:
    """Print a table of each.

    Args:
        console: to print to.
        summary: with what `found` returns.
    """
    if "joint_offset" in summary:
        console.print(offsets.table(summary["joint_offset"]))
    if "patches" in summary:
        console.print(patches.table(summary["patches"]))


def save(settings: ExplorationSettings, summary: Mapping[str, Any], source: str) -> None:
    """Write the file of `--save-offsets`, if it is asked for.

    Args:
        settings: of the exploration.
        summary: with what `found` returns.
        source: says what was explored, in a line.
    """
    if settings.save_offsets is not None:
        offsets.save(Path(settings.save_offsets), summary["joint_offset"], source, summary.get("patches", {}))
