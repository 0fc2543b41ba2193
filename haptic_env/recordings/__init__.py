"""Recordings of hands, from files: `read` one, `resample` it to the control rate, match it to a hand, `write` one.

Add a reader as a file here and a line in `READERS`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from haptic_env import validate
from haptic_env.moved import renamed
from haptic_env.recordings import archive, cyberglove
from haptic_env.recordings.column_map import ColumnMap, read_columns
from haptic_env.recordings.cyberglove import Calibration, calibration_for, read_calibration
from haptic_env.recordings.foreign import FOREIGN, has_touch, read_measured
from haptic_env.recordings.measured import MeasuredTouch
from haptic_env.recordings.recording import LARGEST_GAP, ObserverInputs, Recording, Track
from haptic_env.recordings.resampling import resample

READERS: dict[str, Callable[..., Recording]] = {".npz": archive.read, ".txt": cyberglove.read}

__all__ = [
    "FOREIGN",
    "READERS",
    "Calibration",
    "ColumnMap",
    "MeasuredTouch",
    "ObserverInputs",
    "Recording",
    "Track",
    "calibration_for",
    "has_touch",
    "read",
    "read_calibration",
    "read_columns",
    "read_measured",
    "resample",
    "write",
]

__getattr__ = renamed(__name__, {"Felt": "ObserverInputs"})


def read(
    path: Path | str,
    *,
    part: str | None = None,
    calibration: Calibration | None = None,
    largest_gap: float = LARGEST_GAP,
) -> Recording:
    """Read a recording from a file.

    A `.npz` is of the format of `archive` or of `adroit_demonstrations`, a `.txt` of a CyberGlove.

    Args:
        path: of the file.
        part: which recording, of a file that holds several.
        calibration: what the sensors of a glove mean; a `.txt` needs one.
        largest_gap: s, between two frames.

    Returns:
        The recording.

    Raises:
        ValueError: for what is wrong with the file; it names the file, and the line or frame (both count from 0 in an
            `.npz`, from 1 in a text).
        OSError: where it cannot be read.
    """
    place = validate.path("path", path)
    reader = READERS[validate.choice("kind of recording", place.suffix.lower(), READERS)]
    gap = validate.number("largest_gap", largest_gap, above=0.0, unit="s")
    if calibration is not None:
        validate.instance("calibration", calibration, Calibration, "a Calibration, as read_calibration gives")
    return reader(place, part=part, calibration=calibration, largest_gap=gap)


write = archive.write
