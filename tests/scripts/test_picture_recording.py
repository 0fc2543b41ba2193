"""The picture of a recorded hand and its map."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from matplotlib.image import imread

from haptic_env import hands, recordings
from haptic_env.recordings import Recording
from haptic_env.recordings.recording import Track
from haptic_lab.commands import picture_recording
from tests.haptic_env.movements import closing
from tests.haptic_env.own_hands import GRIPPER
from tests.haptic_env.test_rendering import offscreen  # noqa: F401 - skips where nothing can be drawn


@pytest.fixture
def captured(tmp_path: Path) -> Path:
    """Two fingers that close."""
    recordings.write(tmp_path / "captured.npz", closing())
    return tmp_path / "captured.npz"


def test_touching_patches_and_touched_voxels_are_seen(captured: Path, tmp_path: Path) -> None:
    files = ["--recording", str(captured), "--shape", "cube", "--out", str(tmp_path / "it" / "seen.png")]
    assert picture_recording.main([*files, "--at", "0.1", "0.78", "--sigma", "1", "--view", "-90", "10"]) == 0
    red, green, _ = np.moveaxis(imread(tmp_path / "it" / "seen.png")[..., :3], -1, 0)
    lit = (red > 0.3) & (red > 1.45 * green)  # redder than skin and object, seen through the latter too
    height, width = lit.shape
    before, after = lit[: height // 2, : width // 2], lit[: height // 2, width // 2 :]
    assert before.sum() == 0
    assert after.sum() > 10


def test_a_hand_of_ones_own_is_drawn_and_told_by_its_file(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    gripper = str(GRIPPER / "gripper.toml")
    hand, time = hands.make(gripper), 0.02 * np.arange(20)
    still = Track(np.zeros((20, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (20, 1)))
    angles = hand.rest_pose + 0.5 * time[:, None]
    recordings.write(tmp_path / "its.npz", Recording("made", time, hand.joint_names, angles, still, "", still))
    files = ["--recording", str(tmp_path / "its.npz"), "--shape", "cube", "--out", str(tmp_path / "seen.png")]
    assert picture_recording.main([*files, "--at", "0.1", "--hand", gripper]) == 0
    assert imread(tmp_path / "seen.png").std() > 0.05
    for more, told in ([], "say which it is by --hand"), (["--hand", "paw"], "unknown --hand or --env 'paw'"):
        with pytest.raises(SystemExit):
            picture_recording.main([*files, *more])
        assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--at", "nan"], "--at must be a finite number in [0, 36000] s, got nan"),
        (["--at", "0.1", "-1"], "--at must be a finite number in [0, 36000] s, got -1"),
        (["--view", "0", "inf"], "--view must be a finite number in [-360, 360] degrees, got inf"),
        (["--sigma", "nan"], "--sigma must be a finite number"),
        (["--seed", "-1"], "--seed must be an integer"),
        (["--out", "it.txt"], "unknown kind of picture in --out '.txt'"),
        (["--out", "/dev/null/it.png"], "--out must be in a folder that can be written to"),
        (["--recording", "nowhere.npz"], "nowhere.npz"),
    ],
)
def test_bad_input_is_one_clear_line(
    captured: Path, arguments: list[str], told: str, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit) as ended:
        picture_recording.main(["--recording", str(captured), "--shape", "cube", *arguments])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in error
    assert error.count("\n") == 1


def test_without_opengl_it_says_what_to_do(
    captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise mujoco.FatalError("an OpenGL platform library has not been loaded")

    monkeypatch.setattr(mujoco, "Renderer", fail)
    files = ["--recording", str(captured), "--shape", "cube", "--at", "0.1", "--out", str(tmp_path / "it.png")]
    with pytest.raises(SystemExit) as ended:
        picture_recording.main(files)
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert "draws with OpenGL, which is not to be had here" in error
    assert "set MUJOCO_GL=egl" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "it.png").exists()


def test_it_needs_the_pose_of_the_object(captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    whole = recordings.read(captured)
    alone = Recording("made", whole.time, whole.joint_names, whole.joint_angles)
    recordings.write(tmp_path / "alone.npz", alone)
    with pytest.raises(SystemExit) as ended:
        picture_recording.main(["--recording", str(tmp_path / "alone.npz"), "--shape", "cube"])
    assert ended.value.code == 2
    assert "does not say where the hand and the object were" in capsys.readouterr().err
