"""Recordings of no hand: another unit, numbers that nothing has, times that no clock tells."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from agents.follow_recording import FollowRecording
from haptic_env import recordings, shapes
from haptic_env.recordings import ObserverInputs, Recording, Track
from haptic_env.replay import KinematicReplay, Playback
from tests.haptic_env.movements import closing

WHOLE = closing()
JOINTS = len(WHOLE.joint_names)
CUBE = shapes.make("cube", (0.04,) * 3)
UndoRecord = Callable[[np.ndarray], np.ndarray]


def changed(what: str, change: UndoRecord) -> dict[str, Any]:
    """Of `closing`, with one of its arrays changed."""
    arrays = {
        "time": WHOLE.time,
        "joint_angles": WHOLE.joint_angles,
        "root_position": WHOLE.root.position,  # type: ignore[union-attr]
        "root_quaternion": WHOLE.root.quaternion,  # type: ignore[union-attr]
        "object_position": WHOLE.object.position,  # type: ignore[union-attr]
        "object_quaternion": WHOLE.object.quaternion,  # type: ignore[union-attr]
    }
    arrays[what] = change(arrays[what].copy())
    return arrays


def at(frame: Any, value: float) -> UndoRecord:
    def change(array: np.ndarray) -> np.ndarray:
        array[frame] = value
        return array

    return change


WRONG: list[tuple[str, UndoRecord, str]] = [
    ("joint_angles", np.rad2deg, "joint_angles of .*_flexion is .* beyond 12.57 rad; .* are these degrees"),
    ("joint_angles", at((7, 2), 1e300), r"joint_angles of thumb_pip_flexion is 1e\+300 at frame 7, beyond 12.57 rad"),
    ("joint_angles", at((7, 2), np.nan), "joint_angles of thumb_pip_flexion is nan at frame 7, which is not finite"),
    ("joint_angles", at((7, 2), -np.inf), "joint_angles of thumb_pip_flexion is -inf at frame 7"),
    ("joint_angles", lambda q: q + 1j, "joint_angles must be numbers, got complex128"),
    ("joint_angles", lambda q: q.astype(str), "joint_angles must be numbers, got <U"),
    ("joint_angles", lambda q: q[:, :1], r"joint_angles must have shape \(40, 8\), got \(40, 1\)"),
    (
        "joint_angles",
        at((np.s_[20:], 3), -6.1),
        "joint_angles of thumb_dip_flexion leap from .* to -6.1 rad at frame 20",
    ),
    ("time", lambda t: 1e300 * t, "time is|comes after a gap"),
    ("time", lambda t: 1e3 * t, r"frame 1 comes after a gap of more than 0.1 s \(0 s, then 20 s\)"),
    ("time", lambda t: 3600 * t, "frame 1 comes after a gap of more than 0.1 s"),
    ("time", lambda t: t + 1e12, r"time is 1e\+12 s at frame 0; it must lie in \[-1e\+10, 1e\+10\] s"),
    ("time", lambda t: 1e-9 * t, "frame 1 comes less than 1e-06 s after the one before it"),
    ("time", lambda t: t[::-1], "frame 1 lies before the one before it"),
    ("time", lambda t: t * 1j, "time must be numbers, got complex128"),
    *[
        (f"{body}_{part}", change, told)
        for body in ("root", "object")
        for part, change, told in (
            ("position", lambda x: 1e3 * x, "_position of .* is .* beyond 100 m; places are metres; are these milli"),
            ("position", at(np.s_[:], 1e300), r"_position of x is 1e\+300 at frame 0, beyond 100 m"),
            ("position", at(np.s_[:], 1e17), r"_position of x is 1e\+17 at frame 0, beyond 100 m"),
            ("position", at((30, 1), 6.0), r"apart at frame 30; a hand reaches at most 5 m; places are metres"),
            ("position", at((30, 1), np.nan), "_position of y is nan at frame 30"),
            ("quaternion", at(np.s_[:], 1e-5), "_quaternion at frame 0 has length 2e-05"),
            ("quaternion", at(np.s_[:], 1e300), r"_quaternion at frame 0 has length 2e\+300"),
            ("quaternion", at(3, 0.0), "_quaternion at frame 3 has length 0, but that of a rotation .wxyz. is 1"),
            ("quaternion", lambda q: 1.02 * q, "_quaternion at frame 0 has length 1.02"),
        )
    ],
]


@pytest.mark.parametrize(("what", "change", "told"), WRONG)
def test_what_no_hand_does_is_refused_with_its_frame(tmp_path: Path, what: str, change: UndoRecord, told: str) -> None:
    arrays = changed(what, change)
    np.savez(tmp_path / "it.npz", joint_names=WHOLE.joint_names, **arrays)
    with pytest.raises(ValueError, match=rf"it\.npz: .*(?:{told})"):
        recordings.read(tmp_path / "it.npz")


@pytest.mark.parametrize("what", ["time", "joint_angles", "object_position"])
def test_what_is_masked_is_refused(what: str) -> None:
    arrays = changed(what, lambda array: np.ma.masked_greater(array, 0.1))
    track = Track(arrays["object_position"], arrays["object_quaternion"])
    with pytest.raises(ValueError, match=f"{what} must be numbers, got a masked array"):
        replace(WHOLE, time=arrays["time"], joint_angles=arrays["joint_angles"], object=track)


@pytest.mark.parametrize(
    ("part", "value", "told"),
    [
        (0, 1.5, r"torques of .* is 1.5 at frame 0, beyond \[-1, 1\]; they are fractions"),
        (0, np.nan, "torques of .* is nan"),
        (1, 45.0, "felt_angles of .* is 45 at frame 0, beyond 12.57 rad; .* degrees"),
        (2, 0.5, "contacts must be 0 or 1, got 0.5"),
        (2, 1j, "contacts must be numbers, got complex128"),
    ],
)
def test_what_was_felt_is_what_may_be_felt(part: int, value: Any, told: str) -> None:
    parts = [np.zeros((40, JOINTS)), np.zeros((40, JOINTS)), np.zeros((40, 50))]
    parts[part] = np.full(parts[part].shape, value)
    with pytest.raises(ValueError, match=told):
        replace(WHOLE, felt=ObserverInputs(*parts))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("joint_names", "told"),
    [
        ((), "1 to 1000 names, got 0"),
        (tuple(map(str, range(2000))), "1 to 1000 names, got 2000"),
        ("a", "must be text"),
        ((1.0,), "must be text"),
        (("a", "a"), "joint a is named twice"),
    ],
)
def test_joints_have_names(joint_names: Any, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        Recording("made", np.arange(2.0), joint_names, np.zeros((2, len(joint_names))))


@pytest.mark.parametrize("value", [np.arange(8), np.array([b"a"] * 8), np.array([["a"] * 8] * 2)])
def test_names_in_a_file_are_text(tmp_path: Path, value: np.ndarray) -> None:
    np.savez(tmp_path / "it.npz", time=WHOLE.time, joint_names=value, joint_angles=WHOLE.joint_angles)
    with pytest.raises(ValueError, match=r"it\.npz: .*"):
        recordings.read(tmp_path / "it.npz")


@pytest.mark.parametrize("name", ["root_body", "object_mesh", "settings"])
def test_texts_in_a_file_are_text(tmp_path: Path, name: str) -> None:
    arrays = {"time": WHOLE.time, "joint_names": WHOLE.joint_names, "joint_angles": WHOLE.joint_angles}
    for value in (3.0, np.array(["a", "b"]), np.array([b"a"])):
        np.savez(tmp_path / "it.npz", **arrays, **{name: value})
        with pytest.raises(ValueError, match=rf"it\.npz: ({name} must be one text|not a whole)"):
            recordings.read(tmp_path / "it.npz")
    np.savez(tmp_path / "it.npz", **arrays, settings="[" * 100_000)
    with pytest.raises(ValueError, match=r"it\.npz: settings must be a JSON object"):
        recordings.read(tmp_path / "it.npz")


def test_settings_are_what_json_can_say(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="settings must be what JSON can say"):
        recordings.write(tmp_path / "it.npz", replace(WHOLE, settings={"a": {1}}))
    assert not list(tmp_path.iterdir())


# On a hand


def users(recording: Recording) -> list[Callable[[], Any]]:
    felt = ObserverInputs(np.zeros((40, JOINTS)), np.zeros((40, JOINTS)), np.zeros((40, 50), bool))
    env = gym.make("HapticSLAM/TwoFinger-v0")
    return [
        lambda: KinematicReplay("two_finger", recording, CUBE),
        lambda: FollowRecording(env, recording),
        lambda: Playback(env.unwrapped.hand, replace(recording, felt=felt), CUBE),  # type: ignore[attr-defined]
    ]


@pytest.mark.parametrize("which", range(3))
def test_joints_go_a_little_beyond_their_limits_at_most(which: int) -> None:
    users(replace(WHOLE, joint_angles=at((13, 2), 1.7453 + 1.5)(WHOLE.joint_angles.copy())))[which]()
    # An odd frame, which is not there at half the rate, of angles in degrees of fingers that hardly move.
    wrong = replace(WHOLE, time=0.5 * WHOLE.time, joint_angles=at((13, 2), 4.0)(WHOLE.joint_angles.copy()))
    told = (
        r"joint_angles of thumb_pip_flexion is 4 rad at frame 13; of hand 'two_finger' it has \[0, 1.75\] rad, beyond "
        "which recordings may go by 1.57; angles are radians; are these degrees"
    )
    with pytest.raises(ValueError, match=told):
        users(wrong)[which]()


def test_an_exploration_has_a_steady_rate() -> None:
    felt = ObserverInputs(np.zeros((40, JOINTS)), np.zeros((40, JOINTS)), np.zeros((40, 50), bool))
    hand = gym.make("HapticSLAM/TwoFinger-v0").unwrapped.hand  # type: ignore[attr-defined]
    time = WHOLE.time.copy()
    time[20:] += 0.01
    with pytest.raises(ValueError, match=r"at a steady rate, but frame 20 comes 0.03 s after frame 19"):
        Playback(hand, replace(WHOLE, felt=felt, time=time), CUBE)
    with pytest.raises(ValueError, match=r"frames a second must be a finite number in \[1, 500\] Hz, got 1000"):
        Playback(hand, replace(WHOLE, felt=felt, time=0.05 * WHOLE.time), CUBE)


@pytest.mark.parametrize(
    ("seconds", "rate", "told"),
    [
        (1e9, 50.0, r"1e\+09 s at 50 Hz are 5e\+10 frames; .* 2 to 1000000"),
        (0.01, 50.0, "are 1 frames"),
        (1.0, 1e300, r"are 1e\+300 frames"),
    ],
)
def test_a_resampling_has_a_limit(seconds: float, rate: float, told: str) -> None:
    recording = Recording("made", np.array([0.0, seconds]), ("a",), np.zeros((2, 1)))
    with pytest.raises(ValueError, match=told):
        recordings.resample(recording, rate)


def test_a_replay_is_of_an_object_for_a_hand() -> None:
    with pytest.raises(ValueError, match=r"object size must lie in \[0.005, 0.3\] m"):
        KinematicReplay("two_finger", WHOLE, replace(CUBE, size=(40.0,) * 3))
    with pytest.raises(ValueError, match=r"place of the object in the frame of its path must lie in \[-5, 5\]"):
        KinematicReplay("two_finger", WHOLE, replace(CUBE, position=(0.0, 40.0, 0.0)))
