"""The tasks by their names. What is here never changes under its version: what is learnt and judged depends on it."""

from __future__ import annotations

from haptic_env.shapes.sets import SETS
from haptic_lab.learning.presets import MAP, TrainingWorld

OF_NAMES = ("pose", "spread", "motion", "contacts", "names", "time", "rhythm")  # no map: a third of the time
TASKS: dict[str, TrainingWorld] = {
    "Name": TrainingWorld(observation=OF_NAMES),
    "NameUnknown": TrainingWorld(
        shapes=SETS["twenty"],
        yaw_jitter=0.0,
        rotation_jitter=180.0,
        position_jitter=0.02,
        bias_deg=2.0,
        observation=OF_NAMES,
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
