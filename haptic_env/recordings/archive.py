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
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.recordings import adroit_demonstrations
from haptic_env.recordings.recording import Felt, Recording, Track, check_times

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
Content = dict[str, NDArray[Any]]


def read(path: Path, *, part: str | None, largest_gap: float, **_: Any) -> Recording:
    """The recording in `path`, or the `part` of a file of demonstrations; raises `ValueError` for what is wrong."""
    content = load(path)
    if adroit_demonstrations.recognise(content):
        return adroit_demonstrations.pick(path, content, part)
    if part is not None:
        raise ValueError(f"{path}: it holds one recording, no part {part!r}")
    recording = _recording(path, content)
    check_times(str(path), recording.time, largest_gap)
    return recording


def load(path: Path) -> Content:
    """All arrays of an `.npz` file; raises `ValueError` where it is none, or cut short."""
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (zipfile.BadZipFile, zlib.error, EOFError, ValueError, AttributeError) as error:
        raise ValueError(f"{path}: not a whole .npz file ({error})") from error


def write(path: Path | str, recording: Recording) -> None:
    """Write `recording` to `path`, so that `read` gives the same, bit for bit."""
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
        content["settings"] = np.array(json.dumps(dict(recording.settings)))
    np.savez_compressed(path, **content)


def _recording(path: Path, content: Content) -> Recording:
    for name in content:
        try:
            validate.choice("key", name, KEYS)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error
    missing = [name for name in NEEDED if name not in content]
    if missing:
        raise ValueError(f"{path}: the recording misses {', '.join(missing)}; it has {', '.join(content)}")
    time, angles = _numbers(path, content, "time"), _numbers(path, content, "joint_angles")
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
        torques, felt_angles = (_numbers(path, content, name) for name in FELT[:2])
        contacts = validate.binary(f"{path}: contacts", content["contacts"], content["contacts"].shape)
        felt = Felt(torques, felt_angles, contacts)
    return Recording(
        source=str(path),
        time=time,
        joint_names=tuple(map(str, np.atleast_1d(content["joint_names"]))),
        joint_angles=angles,
        root=root if forearm is None else forearm,
        root_body=str(content.get("root_body", "" if forearm is None else FOREARM)),
        object=_track(path, content, "object"),
        mesh=str(content.get("object_mesh", "")),
        felt=felt,
        settings=_settings(path, content),
    )


def _settings(path: Path, content: Content) -> dict[str, Any]:
    text = str(content.get("settings", "{}"))
    try:
        return dict(json.loads(text))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: settings must be a JSON object, got {text!r}") from error


def _track(path: Path, content: Content, name: str) -> Track | None:
    parts = [f"{name}_position", f"{name}_quaternion"]
    present = [part for part in parts if part in content]
    if len(present) == 1:
        raise ValueError(f"{path}: {present[0]} needs the other of {' and '.join(parts)}")
    return Track(*(_numbers(path, content, part) for part in parts)) if present else None


def _numbers(path: Path, content: Content, name: str) -> NDArray[np.float64]:
    try:
        return np.atleast_1d(content[name]).astype(np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: {name} must be numbers, got {content[name].dtype}") from error
