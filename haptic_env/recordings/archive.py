"""Recordings as `.npz` files. T frames, J joints, P patches.

| key | shape, unit | |
|---|---|---|
| `time` | (T,) s | rising |
| `joint_names` | (J,) text | those of the hand, in any order |
| `joint_angles` | (T, J) rad | |
| `root_position`, `root_quaternion` | (T, 3) m, (T, 4) wxyz | where known, the world pose of the hand's `root_body` |
| `root_body` | text | a body of the hand; where it is missing, the frame in which the hand's model is drawn |
| `object_position`, `object_quaternion` | (T, 3) m, (T, 4) wxyz | where known, the world pose of the object |
| `object_mesh` | text | its mesh, in its own frame |
| `torques` | (T, J) fractions | of an exploration, commanded to get to each frame; the first is its reset |
| `felt_angles`, `contacts` | (T, J) rad, (T, P) | of an exploration, felt at each frame |
| `settings` | text, JSON | what that exploration was |

`forearm_position` and `forearm_quaternion` may stand for those of the root: the pose of MyoHand's body `ulna_r`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import reading, validate
from haptic_env.recordings import adroit_demonstrations, checks
from haptic_env.recordings.recording import ObserverInputs, Recording, Track

NEEDED = ("time", "joint_names", "joint_angles")
TRACKS = ("root", "forearm", "object")
FELT = ("torques", "felt_angles", "contacts")
KEYS = (
    *NEEDED,
    *(f"{track}_{part}" for track in TRACKS for part in ("position", "quaternion")),
    "root_body",
    "object_mesh",
    *FELT,
    "settings",
)
FOREARM = "ulna_r"
Content = Mapping[str, NDArray[Any]]


def read(path: Path, *, part: str | None, largest_gap: float, **_: Any) -> Recording:
    """The recording in `path`, or the `part` of a file of demonstrations; raises `ValueError` for what is wrong."""
    content = reading.npz(path)
    if adroit_demonstrations.recognise(content):
        return adroit_demonstrations.pick(path, content, part)
    if part is not None:
        raise ValueError(f"{path}: it holds one recording, no part {part!r}")
    recording = _recording(path, content)
    checks.times(str(path), recording.time, largest_gap)
    return recording


def write(path: Path | str, recording: Recording) -> None:
    """Write `recording` to `path`, so that `read` gives the same, bit for bit.

    Raises `ValueError` for what is no path, and settings that JSON cannot say.
    """
    place = validate.path("path", path)
    content: dict[str, Any] = {
        "time": recording.time,
        "joint_names": np.array(recording.joint_names),
        "joint_angles": recording.joint_angles,
    }
    for name, track in (("root", recording.root), ("object", recording.object)):
        if track is not None:
            content |= {f"{name}_position": track.position, f"{name}_quaternion": track.quaternion}
    if recording.root_body:
        content["root_body"] = np.array(recording.root_body)
    if recording.mesh:
        content["object_mesh"] = np.array(recording.mesh)
    if recording.felt is not None:
        content |= dict(zip(FELT, recording.felt, strict=True))
    if recording.settings:
        try:
            content["settings"] = np.array(json.dumps(dict(recording.settings)))
        except (TypeError, ValueError) as error:
            raise ValueError(f"settings must be what JSON can say, got {recording.settings!r}: {error}") from error
    np.savez_compressed(place, **content)


def _recording(path: Path, content: Content) -> Recording:
    for name in content:
        try:
            validate.choice("key", name, KEYS)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error
    missing = [name for name in NEEDED if name not in content]
    if missing:
        raise ValueError(f"{path}: the recording misses {', '.join(missing)}; it has {validate.listed(content)}")
    time, angles = np.atleast_1d(content["time"]), np.atleast_1d(content["joint_angles"])
    if len(time) != len(angles):
        raise ValueError(f"{path}: cut short: {len(time)} time stamps and {len(angles)} frames of joint_angles")
    root, forearm = _track(path, content, "root"), _track(path, content, "forearm")
    if root is not None and forearm is not None:
        raise ValueError(f"{path}: give root_position or forearm_position, not both")
    felt = None
    if any(name in content for name in FELT):
        absent = [name for name in FELT if name not in content]
        if absent:
            raise ValueError(f"{path}: what was felt needs {', '.join(FELT)}; it misses {', '.join(absent)}")
        felt = ObserverInputs(*(content[name] for name in FELT))
    return Recording(
        source=str(path),
        time=time,
        joint_names=_names(path, content),
        joint_angles=angles,
        root=root if forearm is None else forearm,
        root_body=_text(path, content, "root_body", "" if forearm is None else FOREARM),
        object=_track(path, content, "object"),
        mesh=_text(path, content, "object_mesh", ""),
        felt=felt,
        settings=_settings(path, content),
    )


def _settings(path: Path, content: Content) -> dict[str, Any]:
    text = _text(path, content, "settings", "{}")
    try:
        return dict(json.loads(text))
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: settings must be a JSON object, got {text!r:.200}") from error


def _track(path: Path, content: Content, name: str) -> Track | None:
    parts = [f"{name}_position", f"{name}_quaternion"]
    present = [part for part in parts if part in content]
    if len(present) == 1:
        raise ValueError(f"{path}: {present[0]} needs the other of {' and '.join(parts)}")
    return Track(*(content[part] for part in parts)) if present else None


def _names(path: Path, content: Content) -> tuple[str, ...]:
    value = np.atleast_1d(content["joint_names"])
    if value.dtype.kind != "U" or value.ndim != 1:
        raise ValueError(f"{path}: joint_names must be text of shape (J,), got {value.dtype} of shape {value.shape}")
    return checks.names(str(path), value.tolist())


def _text(path: Path, content: Content, name: str, missing: str) -> str:
    if name not in content:
        return missing
    value = content[name]
    if value.dtype.kind != "U" or value.size != 1:
        raise ValueError(f"{path}: {name} must be one text, got {value.dtype} of shape {value.shape}")
    return str(value.item())
