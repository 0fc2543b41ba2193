"""The tasks by their names. What is here never changes under its version: what is learnt and judged depends on it."""

from __future__ import annotations

from dataclasses import replace

from haptic_env.shapes.sets import SETS
from haptic_lab.learning.presets import MAP, TrainingWorld
from haptic_lab.worlds import environment

SHOWN = ("pose", "spread", "motion", "contacts", "names", "time", "rhythm")  # no map: a third of the time
TASKS: dict[str, TrainingWorld] = {
    "Name": TrainingWorld(observation=SHOWN),
    "NameUnknown": TrainingWorld(
        shapes=SETS["twenty"],
        yaw_jitter=0.0,
        rotation_jitter=180.0,
        position_jitter=0.02,
        bias_deg=2.0,
        observation=SHOWN,
        variants=48,
        temper=0.5,
    ),
    "Map": TrainingWorld(
        task=MAP,
        shapes=SETS["twenty"],
        yaw_jitter=0.0,
        rotation_jitter=180.0,
        seconds=20.0,
        observation=("pose", "spread", "motion", "contacts", "occupancy", "covered", "time", "rhythm"),
    ),
}


def world_of(task: str, hand: str = "two_finger", wrist: str | None = None) -> TrainingWorld:
    """Say what a task explores with a hand.

    Args:
        task: one of `TASKS`.
        hand: that explores.
        wrist: how it is held; None: as it usually is.

    Returns:
        What may be drawn, and how it is rewarded.

    Raises:
        ValueError: for an unknown hand, and a wrist that it has not.
    """
    return replace(TASKS[task], env=environment(hand), wrist=wrist)
