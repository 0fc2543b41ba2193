"""XDF files, as the Lab Streaming Layer records them: streams with clocks of their own, brought to one by pyxdf.

Shapes: T samples.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from haptic_env import extras, reading
from haptic_env.recordings.streams import Stream, Streams
from haptic_env.recordings.tables import whole_file

MAGIC = b"XDF:"


def read(path: Path, part: str | None) -> Streams:
    """Read the streams of numbers of an XDF file.

    Args:
        path: of the file.
        part: None; such a file holds one recording.

    Returns:
        The streams by their names, their columns by the labels of channels.

    Raises:
        ValueError: for what is wrong with it.
        ImportError: where pyxdf is missing.
        OSError: where it cannot be read.
    """
    pyxdf = extras.load("pyxdf", "recordings", "an XDF file")
    whole_file(path, part)
    try:
        content = reading.content(path)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if not content.startswith(MAGIC):
        raise ValueError(f"{path}: not an XDF file, which begins with {MAGIC.decode()!r}")
    talks = logging.getLogger("pyxdf.pyxdf")
    usual, talks.disabled = talks.disabled, True
    try:
        found, _ = pyxdf.load_xdf(io.BytesIO(content), dejitter_timestamps=False, verbose=False)
    except Exception as error:  # a damaged file ends the library in many ways
        raise ValueError(f"{path}: not a whole XDF file ({type(error).__name__}: {error})") from error
    finally:
        talks.disabled = usual
    for each in found:
        if not len(each["time_stamps"]) and _said(each) is None:
            name = str(_first(each["info"], "name"))
            raise ValueError(f"{path}: cut short: stream {name!r} has no samples and says no end")
    numbers = [each for each in found if isinstance(each["time_series"], np.ndarray) and each["time_series"].size]
    if not numbers:
        raise ValueError(f"{path}: none of its {len(found)} streams has numbers; is the file cut short?")
    return Streams(str(path), [_stream(path, each) for each in numbers])


def _stream(path: Path, found: Mapping[str, Any]) -> Stream:
    info = found["info"]
    name, count = str(_first(info, "name")), int(_first(info, "channel_count") or 0)
    values = np.asarray(found["time_series"], dtype=np.float64).reshape(len(found["time_stamps"]), -1)
    if values.shape[1] != count:
        raise ValueError(f"{path}: stream {name!r} has {values.shape[1]} columns, but says {count}")
    told = _said(found)
    if told is None or int(told) != len(values):
        ended = "says no end" if told is None else f"says that it has {told}"
        raise ValueError(f"{path}: cut short: stream {name!r} has {len(values)} samples and {ended}")
    labels = _labels(info, values.shape[1])
    return Stream(name, labels or tuple(f"{name}[{c}]" for c in range(values.shape[1])), values, found["time_stamps"])


def _said(found: Mapping[str, Any]) -> Any:
    """How many samples a stream says at its end that it has; None where it says no end."""
    return _first(found.get("footer", {}).get("info", {}), "sample_count")


def _first(table: Any, name: str) -> Any:
    """The first entry called `name` of an XML element as pyxdf has it; None where there is none."""
    listed = table.get(name) if isinstance(table, Mapping) else None
    return listed[0] if isinstance(listed, list) and listed else None


def _labels(info: Any, count: int) -> tuple[str, ...]:
    """(C,) labels of the channels; none where not all have one of their own."""
    channels = _first(_first(info, "desc"), "channels")
    listed = channels.get("channel", []) if isinstance(channels, Mapping) else []
    labels = tuple(str(_first(each, "label") or "") for each in listed)
    return labels if len(labels) == count and all(labels) and len(set(labels)) == count else ()
