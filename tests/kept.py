"""What a long test has done so far, kept so that a run that was stopped goes on.

Where the environment variable `HAPTIC_SLAM_KEPT` names a folder, arrays are kept there. It is to be emptied where the
code has changed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

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
