"""The main job from end to end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import trimesh

from agents.layers import Layer
from agents.network import Network
from haptic_env import hand_of, shapes
from haptic_lab.commands import explore
from observer.wrappers.belief_observation import BeliefFeatures

pytestmark = pytest.mark.usefixtures("coarse")
ROOT = Path(__file__).resolve().parents[2]
FILES = ["explore.json", "explore.npz", "explore.png", "recording.npz"]
SHORT = ["--seconds", "1", "--particles", "20", "--seed", "3"]


def run(folder: Path, *arguments: str, drawn: bool = False) -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        if not drawn:  # which takes as long as all else
            patch.setattr(explore, "picture", lambda *_: None)
        assert explore.main([*SHORT, "--out", str(folder), *arguments]) == 0
    assert (folder / "explore.png").exists() == drawn
    return json.loads((folder / "explore.json").read_text())


@pytest.fixture(scope="module")
def explored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("explored")
    run(folder, "--shape", "cube", drawn=True)
    return folder


def test_it_names_the_object_and_tells_how_sure_it_is(explored: Path) -> None:
    summary = json.loads((explored / "explore.json").read_text())
    assert summary["truth"] == "cube"
    assert summary["named"] in summary["posterior"]
    assert sum(summary["posterior"].values()) == pytest.approx(1.0)
    assert summary["pose_error"]["haptic SLAM, lagged"]["degrees"] < summary["pose_error"]["raw angles"]["degrees"]
    assert summary["explored_seconds"] == pytest.approx(1.0)


def test_the_trace_is_complete(explored: Path) -> None:
    with np.load(explored / "explore.npz") as trace:
        steps, joints = trace["true_angles"].shape
        assert steps == 50
        for name in ("torques", "felt_angles", "joint_angles", "joint_std", "lagged_joint_angles"):
            assert trace[name].shape == (steps, joints)
            assert np.isfinite(trace[name]).all()
        assert trace["posterior"].shape == (steps, len(trace["labels"]))
        assert trace["occupancy"].ndim == 3


def test_files_are_whole_and_nothing_else_is_left(explored: Path) -> None:
    assert sorted(path.name for path in explored.iterdir()) == FILES
    assert (explored / "explore.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_same_seed_is_the_same_exploration(explored: Path, tmp_path: Path) -> None:
    run(tmp_path, "--shape", "cube")
    with np.load(explored / "explore.npz") as first, np.load(tmp_path / "explore.npz") as second:
        for name in first:
            assert first[name].tobytes() == second[name].tobytes(), name


def test_without_a_shape_the_object_is_hidden_until_the_end(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    summary = run(tmp_path)
    before, after = capsys.readouterr().out.split("After 1 s")
    assert "hidden object" in before
    assert f"in truth it is                  │ a {summary['truth']}" in after


@pytest.mark.parametrize(("shape", "named"), [("torus(0.4)", "none"), ("sphere", "sphere")])
def test_an_object_may_be_none_of_the_candidates(
    tmp_path: Path, capsys: pytest.CaptureFixture, shape: str, named: str
) -> None:
    told = ("--candidates", "cube", "sphere", "--none", "0.2", "--seconds", "8", "--particles", "1")
    summary = run(tmp_path, "--shape", shape, *told, drawn=shape != "sphere")
    assert set(summary["posterior"]) == {"cube", "sphere", "none"}
    assert summary["truth"] == named
    assert summary["correct"]
    assert ("none of these (right)" in capsys.readouterr().out) == (named == "none")


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (("--candidates", "cubee"), "unknown --candidates 'cubee' (did you mean 'cube'?)"),
        (("--candidates",), "--candidates: expected at least one argument"),
        (("--none", "1.5"), "--none must be a finite number in [0, 0.99], got 1.5"),
        (("--none", "nan"), "--none must be"),
    ],
    ids=str,
)
def test_candidates_that_make_no_sense_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture, given: tuple[str, ...], why: str
) -> None:
    with pytest.raises(SystemExit) as ended:
        run(tmp_path / "out", *given)
    assert ended.value.code == 2
    assert why in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_angles_may_be_exact(tmp_path: Path) -> None:
    summary = run(tmp_path, "--sigma", "0", drawn=True)
    assert summary["pose_error"]["raw angles"] == {"degrees": pytest.approx(0.0, abs=1e-4), "sigmas": None}
    assert summary["pose_error"]["haptic SLAM, lagged"]["degrees"] < 0.1


def _box(folder: Path, millimetres: float) -> str:
    trimesh.creation.box((millimetres,) * 3).export(folder / "box.stl")
    return str(folder / "box.stl")


@pytest.mark.parametrize("hand", ["adroit", "myo"])
def test_a_whole_hand_explores_a_mesh(tmp_path: Path, hand: str) -> None:
    box = _box(tmp_path, 70)
    summary = run(
        tmp_path, "--hand", hand, "--shape", box, "--scale", "0.001", "--particles", "3", drawn=hand == "adroit"
    )
    assert summary["truth"] == box
    assert set(summary["posterior"]) == {box, *shapes.SHAPES}


def _model(path: Path, numbers: int, entries: list[str], joints: int = 8) -> str:
    """A network that commands nothing, of so many `numbers`, said to be the `entries` of a belief."""
    seen = gym.spaces.Box(-2.0, 2.0, (numbers,), np.float32) if numbers else None
    if entries:
        env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube")
        hand = hand_of(env)
        seen = BeliefFeatures(hand, list(shapes.SHAPES), 1.0, 50.0, entries).space
    still = Layer(np.zeros((joints, seen.shape[0]), np.float32), np.zeros(joints, np.float32))
    told = {"entries": entries, "hold": 2} if entries else {}
    Network(seen, gym.spaces.Box(-1.0, 1.0, (joints,), np.float32), (), still, squash=False, told=told).write(path)
    return str(path)


def test_a_hand_on_a_wrist_that_moves_explores(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    run(tmp_path, "--hand", "myo", "--wrist", "free", "--shape", "cube", "--policy", "coverage", "--seconds", "0.4")
    with np.load(tmp_path / "explore.npz") as trace:
        assert trace["true_angles"].shape == (20, 29)
    capsys.readouterr()
    with pytest.raises(SystemExit):
        explore.parse(["--recording", str(tmp_path / "recording.npz"), "--wrist", "free"])
    assert "--wrist is for a hand that explores" in capsys.readouterr().err


def test_a_model_of_one_s_own_that_tells_its_entries_explores(tmp_path: Path) -> None:
    model = _model(tmp_path / "own.npz", 0, ["pose", "names", "time"])
    run(tmp_path / "felt", "--policy", model)
    with np.load(tmp_path / "felt" / "explore.npz") as trace:
        assert not trace["torques"].any()


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ("--policy MODEL", "observation Box(5,) float32, and here Dict(joint_angles: Box(8,) float32, contacts: Multi"),
        ("--policy MODEL --hand adroit", "action Box(8,) float32, and here Box("),
        ("--policy trained --hand adroit", "action Box(8,) float32, and here Box("),
    ],
)
def test_a_model_that_does_not_fit_is_refused_before_anything_is_told(
    flags: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(explore, "get_ready", lambda *_: pytest.fail("nothing need be compiled"))
    flags = flags.replace("MODEL", _model(tmp_path / "own.npz", 5, []))
    assert explore.main([*SHORT, "--out", str(tmp_path / "felt"), *flags.split()]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "was trained for another hand or observation: " in said.err
    assert told in said.err
    assert "..." not in said.err, "no bounds are listed"
    assert said.err.count("\n") == 1
    assert not (tmp_path / "felt").exists()


def test_what_the_hand_cannot_hold_is_one_clear_line(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert explore.main([*SHORT, "--out", str(tmp_path), "--shape", _box(tmp_path, 0.2)]) == 2
    error = capsys.readouterr().err
    assert "lies where the hand rests" in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--shape", "cubee"], "choose from cube, cylinder, pyramid, sphere"),
        (["--shape", "none.stl"], "mesh 'none.stl' cannot be read"),
        (["--scale", "0"], "a finite number in (0, inf] m"),
        (["--hand", "foot"], "choose from HapticSLAM/"),
        (["--wrist", "free"], "hand 'two_finger' has no wrist that moves: wrist must be 'fixed', got 'free'"),
        (["--hand", "two_finger_arm", "--wrist", "fixed"], "wrist must be 'free', got 'fixed'"),
        (["--hand", "myo", "--wrist", "loose"], "unknown wrist 'loose'; choose from fixed, free"),
        (["--policy", "scratch"], "choose from"),
        (["--sigma", "nan"], r"finite number in [0, 90] degrees"),
        (["--sigma", "-1"], r"finite number in [0, 90] degrees"),
        (["--sigma", "loud"], "invalid float value: 'loud'"),
        (["--particles", "0"], "an integer in [1, 100000]"),
        (["--particles", "1.5"], "invalid int value: '1.5'"),
        (["--seconds", "0"], "a finite number in (0, 3600] s"),
        (["--seconds", "inf"], "a finite number in (0, 3600] s"),
        (["--seed", "-1"], "an integer in [0, 4294967295]"),
        (["--env", "HapticSLAM/Foot-v0"], "choose from HapticSLAM/"),
        (["--out", "/dev/null/here"], "--out must be a folder"),
        (["--colour", "red"], "unrecognized arguments"),
    ],
)
def test_bad_input_is_one_clear_line(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit) as ended:
        explore.main(["--out", str(tmp_path), *arguments])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in error
    assert error.count("\n") == 1


def test_help_has_an_example(capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        explore.main(["--help"])
    assert ended.value.code == 0
    assert explore.EXAMPLE in capsys.readouterr().out


def test_ctrl_c_ends_with_what_is_there(tmp_path: Path) -> None:
    command = [sys.executable, "-u", str(ROOT / "scripts" / "explore.py"), "--particles", "5", "--seconds", "900"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [*command, "--out", str(tmp_path)], stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        lines = iter(process.stdout.readline, "")
        assert any("Neff" in line for line in lines)
        process.send_signal(signal.SIGINT)
        rest = process.stdout.read()
    assert process.returncode == 130
    assert "Stopped early" in rest
    summary = json.loads((tmp_path / "explore.json").read_text())
    assert 1.0 <= summary["explored_seconds"] < 900
