"""Files of measured touch, by their kinds. Add a reader as a file here and a line in `FOREIGN`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from haptic_env import reading, validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.recordings import archive, checks, tables, xdf, zarr_stores
from haptic_env.recordings.adroit_demonstrations import SUFFIX
from haptic_env.recordings.column_map import ColumnMap
from haptic_env.recordings.measured import Coverage, MeasuredTouch, merge
from haptic_env.recordings.recording import Recording
from haptic_env.recordings.streams import TORQUES, Streams, numbered


def _arrays(path: Path, part: str | None) -> Streams:
    """The arrays of an `.npz`, each a stream."""
    tables.whole_file(path, part)
    content = reading.npz(path)
    numbers = {name: content[name] for name in content if name != "joint_names"}
    return Streams(
        str(path), [numbered(n, each) for n, each in numbers.items() if each.ndim and each.dtype.kind in "biuf"]
    )


KEYS = frozenset(archive.KEYS)
FOREIGN: dict[str, Callable[[Path, str | None], Streams]] = {
    ".csv": tables.read_text,
    ".tsv": tables.read_text,
    ".npz": _arrays,
    ".parquet": tables.read_parquet,
    ".zarr": zarr_stores.read,
    ".zip": zarr_stores.read,
    ".xdf": xdf.read,
}


def has_touch(path: Path | str) -> bool:
    """Tell whether an `.npz` has measured touch rather than a recording of another kind.

    Args:
        path: of the file.

    Returns:
        Whether it has contacts, but no torques; or neither `joint_angles` nor demonstrations.

    Raises:
        ValueError: where it is no `.npz`.
        OSError: where it cannot be read.
    """
    names = set(reading.npz(path))
    if "joint_angles" in names:
        return "contacts" in names and not {"torques", "felt_angles"} & names
    return not any(name.endswith(SUFFIX) for name in names) and not KEYS & names - {"time"}


def _usual(path: Path, content: Mapping[str, Any], hand: Hand) -> ColumnMap:
    """What columns mean where nobody says: they are called as joints and patches are, or stand in their order."""
    if {"joint_names", "joint_angles", "contacts"} <= set(content):
        names = np.atleast_1d(content["joint_names"])
        return ColumnMap(
            str(path),
            joints_stream="joint_angles",
            joints_order=checks.names(str(path), names.tolist()),
            touch_stream="contacts",
            touch_order=hand.patches.names,
        )
    return ColumnMap(str(path), control_hz=_rate(path, content))


def _rate(path: Path, content: Mapping[str, Any]) -> float | None:
    """The rate of the steps, where an `.npz` tells it as `control_hz`."""
    if "control_hz" not in content:
        return None
    try:
        return validate.number("control_hz", content["control_hz"].item(), 1.0, 500.0, unit="Hz")
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def read_measured(path: Path | str, columns: ColumnMap | None, hand: Hand, *, part: str | None = None) -> MeasuredTouch:
    """Read a recording of joints and touch from a file of another program.

    Args:
        path: of the file.
        columns: what its columns mean; None: they are called as the joints and patches of the hand are, angles are
            radians and contacts 0 or 1.
        hand: whose joints and patches they are.
        part: which recording, of a file that holds several.

    Returns:
        The recording, on the steps of an observer.

    Raises:
        ValueError: for what is wrong with the file or the map.
        ImportError: where the library that reads such files is missing.
        OSError: where it cannot be read.
    """
    place = validate.path("path", path)
    reader = FOREIGN[validate.choice("kind of recording with measured touch", place.suffix.lower(), FOREIGN)]
    validate.instance("hand", hand, Hand, "a Hand, as haptic_env.hands.make gives")
    if columns is not None:
        validate.instance("columns", columns, ColumnMap, "a ColumnMap, as read_columns gives")
    streams = reader(place, part)
    if columns is not None:
        return merge(streams, columns, hand)
    content: Mapping[str, Any] = reading.npz(place) if place.suffix.lower() == ".npz" else {}
    found = merge(streams, _usual(place, content, hand), hand, stepped={"time", "control_hz"} <= set(content))
    told = content.get(TORQUES)
    return found if told is None else replace(found, torques=_torques(place, told, found))


def _torques(path: Path, told: Any, found: MeasuredTouch) -> Array:
    """Torques (K, J) of a file that has them for each step of it."""
    try:
        return validate.array(TORQUES, told, (len(found), found.hand.joints), bound=1.0)
    except ValueError as error:
        raise ValueError(f"{path}: {error}, one of each joint for each step") from error


def of_felt(recording: Recording, hand: Hand, control_hz: float) -> MeasuredTouch:
    """Take what was felt in a recording for measured touch, all of it measured.

    Args:
        recording: with `felt`.
        hand: whose joints and patches they are.
        control_hz: Hz, of its frames.

    Returns:
        The same as measured touch.

    Raises:
        ValueError: as `Recording.felt_of`.
    """
    felt = recording.felt_of(hand)
    coverage = Coverage(len(recording), control_hz, 0.0, 0.0, len(hand.patches), 0.0, 0, 0)
    return MeasuredTouch(
        recording.source, hand, control_hz, felt.joint_angles, felt.contacts.astype(np.float64), coverage
    )
