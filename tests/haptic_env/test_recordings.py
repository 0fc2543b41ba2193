"""Recordings in files: what is written is read, and what is wrong is told with its line or frame."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haptic_env import hands, reading, recordings
from haptic_env.recordings import ObserverInputs, Recording, Track
from haptic_env.recordings.adroit_demonstrations import JOINTS

SHARED = Path(__file__).resolve().parents[3] / "shared" / "recordings"
SENSORS = ("bend", "spread")
CALIBRATION = """
sensors = ["bend", "spread"]
unit = "degrees"
[joints]
a = { offset_deg = 10, gains = { bend = -2.0 } }
b = { gains = { bend = 1, spread = 0.5 } }
c = { offset_deg = 5 }
"""


def made(frames: int = 6, **changes: Any) -> Recording:
    """A recording of two joints with everything in it."""
    rng = np.random.default_rng(0)
    turns = rng.standard_normal((frames, 4))
    track = Track(rng.standard_normal((frames, 3)), turns / np.linalg.norm(turns, axis=1, keepdims=True))
    felt = ObserverInputs(
        rng.uniform(-1, 1, (frames, 2)), rng.standard_normal((frames, 2)), rng.random((frames, 3)) < 0.5
    )
    whole = Recording(
        source="made",
        time=0.02 * np.arange(frames),
        joint_names=("a", "b"),
        joint_angles=rng.standard_normal((frames, 2)),
        root=track,
        root_body="wrist",
        object=track,
        mesh="thing.stl",
        felt=felt,
        settings={"sigma": 3.0, "shape": None},
    )
    return replace(whole, **changes)


def arrays(recording: Recording) -> list[bytes]:
    tracks = [each for track in (recording.root, recording.object) if track is not None for each in track]
    parts = [recording.time, recording.joint_angles, *tracks, *(recording.felt or ())]
    return [np.asarray(each).tobytes() for each in parts]


@pytest.fixture
def glove(tmp_path: Path) -> Any:
    """Writes lines of a glove and reads them."""
    meaning = tmp_path / "meaning.toml"
    meaning.write_text(CALIBRATION)

    def read(lines: list[str], **keywords: Any) -> Recording:
        path = tmp_path / "glove.txt"
        path.write_text("\n".join(lines))
        return recordings.read(path, calibration=recordings.read_calibration(meaning), **keywords)

    return read


def row(second: float, *values: object) -> str:
    return f"2014 11 28 08 42 {second:.5f} 1 {' '.join(map(str, values))}"


def test_what_is_written_is_read_bit_for_bit(tmp_path: Path) -> None:
    recording = made()
    recordings.write(tmp_path / "it.npz", recording)
    again = recordings.read(tmp_path / "it.npz")
    assert arrays(again) == arrays(recording)
    for name in ("joint_names", "root_body", "mesh", "settings"):
        assert getattr(again, name) == getattr(recording, name)


def test_what_is_not_known_is_not_written(tmp_path: Path) -> None:
    recordings.write(tmp_path / "it.npz", made(root=None, root_body="", object=None, mesh="", felt=None, settings={}))
    with np.load(tmp_path / "it.npz") as file:
        assert set(file.files) == {"time", "joint_names", "joint_angles"}
    assert recordings.read(tmp_path / "it.npz").root is None


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"joint_angles": np.r_[np.zeros((4, 2)), [[0, np.nan]], np.zeros((1, 2))]}, "of b is nan at frame 4"),
        ({"time": np.array([0, 1, 2, 2, 3, 4]) * 0.02}, "frame 3 repeats the time stamp"),
        ({"time": np.array([0, 1, 2, 1, 3, 4]) * 0.02}, "frame 3 lies before"),
        ({"time": np.array([0, 1, np.inf, 3, 4, 5])}, "time is inf at frame 2"),
        ({"joint_names": ("a", "a")}, "joint a is named twice"),
        ({"root": Track(np.zeros((6, 3)), np.zeros((6, 4)))}, "root_quaternion at frame 0 has length 0"),
        ({"object": Track(np.zeros((5, 3)), np.ones((6, 4)))}, r"object_position must have shape \(6, 3\)"),
    ],
)
def test_a_recording_names_the_frame_that_is_wrong(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        made(**changes)


def test_gaps_are_told_with_their_frame(tmp_path: Path) -> None:
    recording = made(time=np.array([0, 0.02, 0.04, 0.34, 0.36, 0.38]))
    recordings.write(tmp_path / "it.npz", recording)
    with pytest.raises(ValueError, match=r"frame 3 comes after a gap of more than 0.1 s \(0.04 s, then 0.34 s\)"):
        recordings.read(tmp_path / "it.npz")
    assert len(recordings.read(tmp_path / "it.npz", largest_gap=0.5)) == 6


def test_files_that_are_no_recordings(tmp_path: Path) -> None:
    path = tmp_path / "it.npz"
    recordings.write(path, made())
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match=r"not a whole \.npz file"):
        recordings.read(path)
    path.write_text("nothing of the kind")
    with pytest.raises(ValueError, match=r"not a whole \.npz file"):
        recordings.read(path)
    np.savez(path, time=np.arange(3.0), joint_angle=np.zeros((3, 1)))
    with pytest.raises(ValueError, match="did you mean 'joint_angles'"):
        recordings.read(path)
    np.savez(path, time=np.arange(3.0))
    with pytest.raises(ValueError, match="misses joint_names, joint_angles"):
        recordings.read(path)
    np.savez(path, time=np.arange(3.0), joint_names=["a"], joint_angles=np.zeros((2, 1)))
    with pytest.raises(ValueError, match="cut short: 3 time stamps and 2 frames"):
        recordings.read(path)
    np.savez(path, time=np.arange(2.0) / 50, joint_names=["a"], joint_angles=np.zeros((2, 1)), torques=np.zeros((2, 1)))
    with pytest.raises(ValueError, match="misses felt_angles, contacts"):
        recordings.read(path)
    arrays = {"time": np.arange(2.0) / 50, "joint_names": ["a"], "joint_angles": np.zeros((2, 1))}
    np.savez(path, **arrays, torques=np.zeros((2, 1)), felt_angles=np.zeros((2, 1)), contacts=np.full((2, 3), 2))
    with pytest.raises(ValueError, match=r"it.npz: contacts must be 0 or 1, got 2 at index \(0, 0\)"):
        recordings.read(path)
    np.savez(path, **arrays, settings=np.array("{sigma"))
    with pytest.raises(ValueError, match=r"it.npz: settings must be a JSON object, got '{sigma'"):
        recordings.read(path)
    with pytest.raises(ValueError, match=r"unknown kind of recording '.csv'"):
        recordings.read(tmp_path / "it.csv")
    with pytest.raises(FileNotFoundError):
        recordings.read(tmp_path / "nowhere.npz")


def test_the_joints_are_those_of_the_hand() -> None:
    hand = hands.make("two_finger")
    frames = np.tile(np.arange(hand.joints, dtype=float), (3, 1))
    recording = made(3, joint_names=hand.joint_names[::-1], joint_angles=frames, felt=None)
    np.testing.assert_array_equal(recording.columns_of(hand), np.arange(hand.joints)[::-1])
    names = (*hand.joint_names[1:], "tail_flexion")
    with pytest.raises(ValueError, match=f"misses {hand.joint_names[0]} and has unknown tail_flexion; the joints of"):
        replace(recording, joint_names=names).columns_of(hand)


# A glove


def test_a_glove_is_read_with_its_calibration(glove: Any) -> None:
    recording = glove([row(1.0, 10, 4), "", row(1.02, 20, 0), row(1.05, -10, 2)])
    np.testing.assert_allclose(recording.time, [0.0, 0.02, 0.05], atol=1e-6)
    assert recording.joint_names == ("a", "b", "c")
    np.testing.assert_allclose(np.rad2deg(recording.joint_angles), [[-10, 12, 5], [-30, 20, 5], [30, -9, 5]])


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ([row(1, 0, 0), row(1.02, 0)], "line 2: 8 columns instead of 9"),
        ([row(1, 0, 0), "", row(1.02, 0, "nan")], "line 3: spread is 'nan', not finite"),
        ([row(1, 0, 0), row(1.02, "x", 0)], "line 2: bend is 'x', no number"),
        ([row(1, 0, 0), row(1, 0, 0)], "line 2 repeats the time stamp"),
        ([row(1.02, 0, 0), row(1, 0, 0)], r"line 2 lies before the one before it in time .0 s, then -0.02 s."),
        ([row(1, 0, 0), row(1.5, 0, 0)], "line 2 comes after a gap of more than 0.1 s"),
        ([row(1, 0, 0), row(1.02, 0, 0).replace(" 11 ", " 13 ", 1)], "line 2: .* is no date and time"),
        ([row(1, 0, 0), row(np.nan, 0, 0)], "line 2: .* is no date and time .second must be a finite number"),
        ([row(1, 0, 0), row(1.02, 1e300, 0)], "line 2: bend is '1e.300', beyond 1e.06"),
        (
            [row(1, 0, 0), row(1.02, 4000, 0)],
            "joint_angles of a is -139.45.* at line 2, beyond 12.57 rad; .* are these degrees",
        ),
        ([row(1, 0, 0), "", row(1.02, 200, 0)], "joint_angles of a leap from 0.1745.* to -6.8.* rad at line 3"),
        ([row(1, 0, 0), row(1.02, 0, 0).replace(" 28 ", " 28.5 ", 1)], "line 2: .*all but the seconds must be whole"),
        ([row(1, 0, 0)], "needs two frames, got 1 lines"),
        ([], "needs two frames, got 0 lines"),
    ],
)
def test_a_glove_names_the_line_that_is_wrong(glove: Any, lines: list[str], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        glove(lines)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("sensors", "sensor"), "unknown calibration keyword 'sensor'"),
        (('"degrees"', '"turns"'), "unknown unit 'turns'; choose from degrees, radians"),
        (("bend = -2.0", "bent = -2.0"), "unknown sensor of a 'bent' .did you mean 'bend'"),
        (("-2.0", '"two"'), "gain of bend for a must be a finite number"),
        (("offset_deg = 10", "offset = 10"), "unknown joint a keyword 'offset'"),
        (
            ("offset_deg = 10", "offset_deg = 1e300"),
            r"offset_deg of a must be a finite number in \[-360, 360\] degrees",
        ),
        (("-2.0", "nan"), r"gain of bend for a must be a finite number in \[-1000, 1000\], got nan"),
        (("{ bend = -2.0 }", "3"), "gains of a must be a table with a number for each sensor, got 3"),
        (("c = {", "c = 3 #"), "joint c must be a table"),
        (("[joints]", "[joints"), "Expected"),
    ],
)
def test_a_calibration_names_what_is_wrong(tmp_path: Path, change: tuple[str, str], told: str) -> None:
    path = tmp_path / "meaning.toml"
    path.write_text(CALIBRATION.replace(*change))
    with pytest.raises(ValueError, match=rf"(?s)meaning\.toml.*{told}"):
        recordings.read_calibration(path)


@pytest.mark.parametrize("name", ["it.txt", "it.toml"])
def test_texts_have_a_size_limit(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(reading.LARGEST_TEXT + 1)  # takes no room
    read: Any = recordings.read_calibration
    if path.suffix == ".txt":
        read = partial(recordings.read, calibration=recordings.calibration_for("adroit"))
    with pytest.raises(ValueError, match=rf"{name}: the file is larger than \d+ MiB, which is the most that is read"):
        read(path)


def test_a_glove_needs_a_calibration(tmp_path: Path) -> None:
    (tmp_path / "glove.txt").write_text(row(1, 0, 0))
    with pytest.raises(ValueError, match="needs a calibration"):
        recordings.read(tmp_path / "glove.txt")
    with pytest.raises(ValueError, match="unknown hand with a glove's calibration 'foot'; choose from adroit, myo"):
        recordings.calibration_for("foot")


@pytest.mark.parametrize("hand", ["adroit", "myo"])
def test_the_calibrations_that_come_have_every_joint(hand: str) -> None:
    assert set(recordings.calibration_for(hand).joint_names) == set(hands.make(hand).joint_names)


# Demonstrations


def test_demonstrations_are_read_by_their_part(tmp_path: Path) -> None:
    path = tmp_path / "demos.npz"
    seen = np.random.default_rng(0).standard_normal((5, 39))
    np.savez(path, x_obs=seen, x_act=seen, y_obs=seen[:4])
    recording = recordings.read(path, part="x")
    np.testing.assert_array_equal(recording.joint_angles, seen[:, 3:27])
    assert set(recording.joint_names) == set(hands.make("adroit").joint_names) == set(JOINTS)
    assert recording.seconds == pytest.approx(0.04)
    with pytest.raises(ValueError, match="several recordings; choose a part from x, y"):
        recordings.read(path)
    with pytest.raises(ValueError, match=r"unknown part of .* 'z'"):
        recordings.read(path, part="z")
    np.savez(path, x_obs=seen[:, :20])
    with pytest.raises(ValueError, match=r"x_obs must have shape \(T, 27 or more\), got \(5, 20\)"):
        recordings.read(path)


# Resampling


def test_what_has_the_control_rate_keeps_its_bits() -> None:
    recording = made(time=0.02 * np.arange(6) + 7.0 + 1e-8)
    assert arrays(recordings.resample(recording, 50.0)) == arrays(recording)


def test_resampling_goes_through_the_frames_and_does_not_overshoot() -> None:
    time = np.array([0.0, 0.03, 0.05, 0.11])
    turns = np.array([[1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, -1], [1, 0, 0, 0]], dtype=float)
    track = Track(time[:, None] * [1.0, -2.0, 0.0], turns)
    angles = np.array([[0.0, 1.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    recording = made(4, time=time + 3.0, joint_angles=angles, root=track, object=None, felt=None)
    finer = recordings.resample(recording, 100.0)
    np.testing.assert_allclose(finer.time, 3.0 + 0.01 * np.arange(12))
    np.testing.assert_allclose(finer.joint_angles[[0, 3, 5, 11]], angles, atol=1e-12)
    assert finer.joint_angles.min() >= -1e-12
    assert finer.joint_angles.max() <= 1.0 + 1e-12
    assert finer.root is not None
    np.testing.assert_allclose(finer.root.position, 0.01 * np.arange(12)[:, None] * [1.0, -2.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(finer.root.quaternion, axis=1), 1.0)
    np.testing.assert_allclose(np.abs(finer.root.quaternion[4]), [0, 0, 0, 1], atol=1e-9)  # q and -q are one turn


@pytest.mark.parametrize("least", [5e-324, 1e-300])
def test_what_hardly_changes_is_resampled(least: float) -> None:
    angles = least * np.arange(12.0).reshape(6, 2)
    finer = recordings.resample(made(joint_angles=angles, felt=None), 100.0)
    assert (np.abs(finer.joint_angles) <= angles.max()).all()


def test_what_was_felt_is_not_resampled() -> None:
    with pytest.raises(ValueError, match="cannot be told at another; its own is 50 Hz"):
        recordings.resample(made(), 100.0)


# Recordings of people


@pytest.mark.skipif(not SHARED.exists(), reason="the shared recordings are not here")
@pytest.mark.parametrize("name", ["cubemedium_inspect", "spheremedium_inspect", "cylinderlarge_inspect"])
def test_motion_capture_fits_the_human_hand(name: str) -> None:
    recording = recordings.read(SHARED / f"{name}.npz")
    assert (len(recording), recording.root_body) == (100, "ulna_r")
    assert sorted(recording.columns_of(hands.make("myo"))) == list(range(23))


@pytest.mark.skipif(not SHARED.exists(), reason="the shared recordings are not here")
@pytest.mark.parametrize(("name", "seconds"), [("cyberglove_ball_grasp", 3.8), ("cyberglove_pen_interaction", 35.5)])
def test_gloves_of_people_are_read(name: str, seconds: float) -> None:
    recording = recordings.read(SHARED / f"{name}.txt", calibration=recordings.calibration_for("adroit"))
    assert recording.seconds == pytest.approx(seconds, abs=0.05)
    assert len(recordings.resample(recording, 50.0)) == int(recording.seconds * 50) + 1


@pytest.mark.parametrize("path", [None, 3, "", "a\0b.npz", "\ud800.npz"])
def test_what_is_no_path_is_no_recording(path):
    with pytest.raises(ValueError, match=r"path must be the path of a file, .* got"):
        recordings.read(path)
    with pytest.raises(ValueError, match=r"path must be the path of a file, .* got"):
        recordings.read_calibration(path)


@pytest.mark.parametrize("calibration", ["adroit", {"sensors": []}, 3])
def test_what_is_no_calibration_is_refused(tmp_path, calibration):
    (tmp_path / "a.txt").write_text("")
    with pytest.raises(ValueError, match="calibration must be a Calibration, as read_calibration gives, got"):
        recordings.read(tmp_path / "a.txt", calibration=calibration)


@pytest.mark.parametrize("sensors", [np.zeros((2, 3)), np.full((2, 22), np.nan), np.zeros(22), ["a"] * 22])
def test_what_no_glove_says_has_no_angles(sensors):
    with pytest.raises(ValueError, match="sensors must be"):
        recordings.calibration_for("adroit").joint_angles(sensors)
