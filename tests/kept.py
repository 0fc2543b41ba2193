"""What a long test has done so far, kept so that a run that was stopped goes on.

Where the environment variable `HAPTIC_SLAM_KEPT` names a folder, arrays are kept there. It is to be emptied where the
code has changed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from observer.belief import Belief
from observer.pose.seen import LaggedPose

Arrays = dict[str, np.ndarray]


def folder_of(test: str, instead: pytest.TempPathFactory) -> Path:
    """Where to keep what a test does: for good, or as long as it runs."""
    told = os.environ.get("HAPTIC_SLAM_KEPT")
    folder = Path(told) / test if told else instead.mktemp(test)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def once(path: Path, make: Callable[[], Arrays]) -> Arrays:
    """What was made, now or before; whole or not at all."""
    if not path.exists():
        half = path.with_suffix(".half.npz")
        np.savez(half, **make())  # type: ignore[arg-type]
        half.replace(path)
    with np.load(path) as arrays:
        return dict(arrays)


def told(beliefs: Mapping[str, Sequence[Belief]]) -> Arrays:
    """What each one's beliefs of an exploration tell of poses, and what was felt there: all that a namer hears."""
    kept = {}
    for who, course in beliefs.items():
        steps = [i for i, each in enumerate(course) if each.transition is not None and each.lagged_contacts is not None]
        kept[f"{who} steps"] = np.array(steps)
        kept[f"{who} mean"] = np.array([course[i].transition.mean for i in steps])  # type: ignore[union-attr]
        kept[f"{who} covariance"] = np.array([course[i].lagged_covariance for i in steps])
        kept[f"{who} contacts"] = np.array([course[i].lagged_contacts for i in steps])
    return kept


def poses(felt: Arrays, who: str) -> dict[int, LaggedPose]:
    """What `told` kept, by step."""
    steps, *rest = (felt[f"{who} {what}"] for what in ("steps", "mean", "covariance", "contacts"))
    return {int(step): LaggedPose(*each, None) for step, *each in zip(steps, *rest, strict=True)}
