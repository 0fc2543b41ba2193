"""Recordings and what is made of them. T frames, J joints."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from agents.follow_recording import FollowRecording
from agents.repeat_torques import RepeatTorques
from haptic_env import reading, recordings
from haptic_env.recordings import Calibration, Recording
from haptic_env.replay import KinematicReplay, Playback, roots
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.files import archives, file, out
from tests.properties.parameters import Parameter, array, binary, name, number, one_of, path
from tests.properties.rule import Allowed
from tests.properties.strategies import odd_names, odd_numbers, odd_paths

J, T = samples.JOINTS, samples.FRAMES
FILE = Allowed(files=True, words=("recording", "input", "calibration"))
CALIBRATION = Parameter(st.none() | st.just(samples.calibration()), odd_numbers | odd_names)


def _used(recording: Recording) -> Any:
    return recording, recording.seconds, len(recording), recordings.resample(recording, 50.0)


def _read(path: Any, **call: Any) -> Any:
    return _used(recordings.read(path, **call))


def _measured(path: Any, columns: Any) -> Any:
    told = recordings.read_measured(path, columns, samples.hand())
    return np.isnan(told.joint_angles).mean(), np.isnan(told.contacts).mean(), told.seconds


def _angles_of(calibration: Calibration) -> Any:
    return calibration, calibration.joint_angles(np.ones((2, len(calibration.sensors))))


def _made(**call: Any) -> Any:
    for what in ("root", "object"):
        parts = [call.pop(f"{what}_{part}", None) for part in ("position", "quaternion")]
        call[what] = samples.track()._replace(
            **{key: value for key, value in zip(("position", "quaternion"), parts, strict=True) if value is not None}
        )
    felt = {key: call.pop(key) for key in ("torques", "felt_angles", "contacts") if key in call}
    if "felt_angles" in felt:
        felt["joint_angles"] = felt.pop("felt_angles")
    call["felt"] = samples.felt()._replace(**felt)
    return samples.recording(**call)


def _written(path: Any = None, **call: Any) -> Any:
    """What is written is read again, bit for bit."""
    made = _made(**call)
    place = out("written.npz" if path is None else path)
    recordings.write(place, made)
    if path is None:
        again = recordings.read(place)
        assert again.joint_angles.tobytes() == np.asarray(made.joint_angles, np.float64).tobytes()
        assert again.joint_names == tuple(made.joint_names)
    return made


def _replayed(recording: Recording, actions: Any = None, **keywords: Any) -> Any:
    env = KinematicReplay("two_finger", recording, samples.solid(), **keywords)
    seen = [env.reset(seed=0), env.step(np.zeros(J) if actions is None else actions)]
    env.close()
    return seen


def _played(recording: Recording) -> Any:
    env = Playback(samples.hand(), recording, samples.solid())
    return env.reset(seed=0), env.step(np.zeros(J)), roots(recording, samples.hand())


def _followed(recording: Recording, stiffness: Any = 1.0) -> Any:
    env = _env()
    policy, (seen, _) = FollowRecording(env, recording, stiffness=stiffness), env.reset(seed=0)
    return policy.predict(seen)


@lru_cache(maxsize=1)
def _env() -> Any:
    return samples.environment()


RECORDING: dict[str, Parameter] = {
    "source": one_of("a"),
    "time": Parameter(st.just(np.arange(T) / 50), array((T,), 0, 1).odd),
    "joint_names": Parameter(
        st.just(samples.hand().joint_names),
        st.lists(odd_names, min_size=J, max_size=J).map(tuple) | odd_names | odd_numbers,
    ),
    "joint_angles": array((T, J), -0.2, 1.0),
    "root_position": array((T, 3), -0.1, 0.1),
    "root_quaternion": array((T, 4)),
    "object_position": array((T, 3), -0.1, 0.1),
    "object_quaternion": array((T, 4)),
    "root_body": Parameter(st.just(""), odd_names),
    "mesh": Parameter(st.just("ball"), odd_names),
    "torques": array((T, J)),
    "felt_angles": array((T, J), -0.2, 1.0),
    "contacts": binary((T, samples.PATCHES)),
    "settings": Parameter(st.just({"seed": 1}), odd_names | odd_numbers | st.just({"a": object()})),
}
MADE = Allowed(words=("recording", "root", "object", "frame", "time", "joint", "settings"))


def _parts(call: dict[str, Any]) -> Any:
    return _used(_made(**call))


def _of_parts(then: Any) -> Any:
    """`then` of a recording whose felt part is left out where it was not said."""

    def run(extra: Any = None, **call: Any) -> Any:
        felt = any(key in call for key in ("torques", "felt_angles", "contacts"))
        made = _made(**call)
        if not felt:
            made = samples.recording(
                **{key: getattr(made, key) for key in ("time", "joint_names", "joint_angles", "root", "object")},
                felt=None,
            )
        return then(made) if extra is None else then(made, extra)

    return run


def _arrays(path: Any) -> Any:
    read = reading.npz(path)
    return {name: read[name] for name in read if read[name].dtype.kind != "f"}


NPZ = file(".npz", *samples.recordings_npz(), also=archives(samples.arrays())).always

ENTRIES: dict[str, Entry] = {
    "haptic_env.reading.npz": Entry(_arrays, {"path": NPZ}, FILE),
    "haptic_env.reading.Arrays": Entry(
        lambda whole: list(reading.Arrays(whole, "input")),
        {"whole": Parameter(st.just(samples.recordings_npz()[0]), st.binary(max_size=60), needed=True)},
        FILE,
        weight=0.3,
    ),
    "haptic_env.recordings.READERS[.npz]": Entry(
        _read,
        {
            "path": file(".npz", *samples.recordings_npz(), also=archives(samples.arrays())).always,
            "part": Parameter(st.none() | st.just("a"), odd_names),
            "largest_gap": number(0.1, 1.0),
        },
        FILE,
        weight=6,
    ),
    "haptic_env.recordings.READERS[.txt]": Entry(
        _read,
        {
            "path": file(".txt", samples.glove_txt()).always,
            "calibration": Parameter(st.just(samples.calibration()), CALIBRATION.odd, needed=True),
            "part": Parameter(st.none(), odd_names),
            "largest_gap": number(0.1, 1.0),
        },
        FILE,
        weight=2,
    ),
    "haptic_env.recordings.read": Entry(_read, {"path": path(st.just("missing.npz")).always}, FILE),
    "haptic_env.recordings.read_measured": Entry(
        lambda path, columns=None: _measured(path, columns),
        {
            "path": file(".csv", samples.measured_csv()).always,
            "columns": Parameter(st.none(), odd_names | odd_numbers),
        },
        Allowed(files=True, words=("joint", "taxel", "time", "column", "steps", "touch")),
        weight=2,
    ),
    "haptic_env.recordings.read_columns": Entry(
        lambda path: recordings.read_columns(path),
        {"path": file(".toml", samples.columns_toml()).always},
        FILE,
        weight=2,
    ),
    "haptic_env.recordings.has_touch": Entry(lambda path: recordings.has_touch(path), {"path": NPZ}, FILE),
    "haptic_env.recordings.read_calibration": Entry(
        lambda path: _angles_of(recordings.read_calibration(path)),
        {"path": file(".toml", samples.calibration_toml()).always},
        FILE,
        weight=2,
    ),
    "haptic_env.recordings.calibration_for": Entry(
        lambda hand: _angles_of(recordings.calibration_for(hand)), {"hand": name(["adroit"]).always}
    ),
    "haptic_env.recordings.Calibration.joint_angles": Entry(
        lambda sensors: samples.calibration().joint_angles(sensors), {"sensors": array((4, 3)).always}
    ),
    "haptic_env.recordings.Recording": Entry(lambda **call: _made(**call), RECORDING, MADE, weight=3),
    "haptic_env.recordings.Recording.columns_of": Entry(
        lambda hand: samples.recording().columns_of(hand),
        {"hand": Parameter(st.just(samples.hand()), odd_numbers | odd_names, needed=True)},
    ),
    "haptic_env.recordings.resample": Entry(
        lambda control_hz, **call: recordings.resample(_made(**call), control_hz),
        {"control_hz": number(1.0, 200.0).always, **RECORDING},
        MADE,
        weight=2,
    ),
    "haptic_env.recordings.write": Entry(
        _written, {"path": Parameter(st.none(), odd_paths), **RECORDING}, Allowed(files=True, words=MADE.words)
    ),
    "haptic_env.replay.KinematicReplay": Entry(
        lambda sigma_deg=3.0, **call: _of_parts(lambda made: _replayed(made, sigma_deg=sigma_deg))(**call),
        {"sigma_deg": number(0.0, 90.0), **{key: RECORDING[key] for key in list(RECORDING)[1:9]}},
        MADE,
    ),
    "haptic_env.replay.KinematicReplay.step": Entry(
        lambda actions: _replayed(samples.recording(felt=None), actions),
        {"actions": array((J,)).always},
        Allowed(words=("action",)),
    ),
    "haptic_env.replay.Playback": Entry(lambda **call: _played(_made(**call)), RECORDING, MADE),
    "agents.follow_recording.FollowRecording": Entry(
        lambda stiffness=1.0, **call: _of_parts(lambda made: _followed(made, stiffness))(**call),
        {"stiffness": number(0.0, 5.0), **{key: RECORDING[key] for key in ("time", "joint_names", "joint_angles")}},
        MADE,
    ),
    "agents.repeat_torques.RepeatTorques": Entry(
        lambda torques: RepeatTorques(_env(), torques).predict(_env().reset(seed=0)[0]),
        {"torques": array((3, J)).always},
    ),
}
