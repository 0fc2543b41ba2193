"""The picture of a recorded hand and its map."""

from __future__ import annotations

import os
from pathlib import Path

import gymnasium as gym
import numpy as np
import picture_recording
import pytest
from matplotlib.image import imread

from haptic_env import hands, recordings
from haptic_env.recordings import Recording, Track


@pytest.fixture(scope="module", autouse=True)
def offscreen() -> None:
    """Skip where nothing can be drawn, but never in CI."""
    env = gym.make("HapticSLAM/TwoFinger-v0", render_mode="rgb_array")
    env.reset(seed=0)
    try:
        env.render()
    except Exception as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(f"no offscreen rendering here: {error!r}")
    env.close()


@pytest.fixture
def captured(tmp_path: Path) -> Path:
    """Two fingers that close."""
    hand = hands.make("two_finger")
    share = np.linspace(0.0, 1.0, 40)[:, None]
    fist = hand.rest_pose + np.deg2rad([0, 60, 20, 10] * 2)
    still = Track(np.zeros((40, 3)), np.tile([1.0, 0, 0, 0], (40, 1)))
    angles = (1 - share) * hand.rest_pose + share * fist
    made = Recording("made", 0.02 * np.arange(40), hand.joint_names, angles, root=still, object=still)
    recordings.write(tmp_path / "captured.npz", made)
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


def test_it_needs_the_pose_of_the_object(captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    whole = recordings.read(captured)
    alone = Recording("made", whole.time, whole.joint_names, whole.joint_angles)
    recordings.write(tmp_path / "alone.npz", alone)
    with pytest.raises(SystemExit) as ended:
        picture_recording.main(["--recording", str(tmp_path / "alone.npz"), "--shape", "cube"])
    assert ended.value.code == 2
    assert "does not say where the hand and the object were" in capsys.readouterr().err
