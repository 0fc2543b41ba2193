"""explore.py --recording from end to end."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from haptic_env import recordings, shapes
from haptic_env.recordings import ObserverInputs, Recording
from haptic_lab import recorded, replay, worlds
from haptic_lab.commands import explore
from tests.haptic_env.movements import closing

pytestmark = pytest.mark.usefixtures("coarse")
SHARED = Path(__file__).resolve().parents[3] / "shared"
people = pytest.mark.skipif(not SHARED.exists(), reason="the shared recordings are not here")


def run(folder: Path, *arguments: str, drawn: bool = False) -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        if not drawn:  # which takes as long as all else
            patch.setattr(explore, "picture", lambda *_: None)
        assert explore.main(["--particles", "10", "--out", str(folder), *arguments]) == 0
    assert (folder / "explore.png").exists() == drawn
    return json.loads((folder / "explore.json").read_text())


@pytest.fixture
def captured(tmp_path: Path) -> str:
    """A file of motion capture: the pose of the object is known."""
    recordings.write(tmp_path / "captured.npz", closing())
    return str(tmp_path / "captured.npz")


def same_beliefs(first: Path, second: Path) -> None:
    with np.load(first / "explore.npz") as a, np.load(second / "explore.npz") as b:
        assert set(a.files) == set(b.files)
        for name in a.files:
            assert a[name].tobytes() == b[name].tobytes(), name


def test_an_exploration_is_played_back_to_the_same_belief(tmp_path: Path) -> None:
    run(tmp_path / "a", "--shape", "pyramid", "--seconds", "0.6", "--seed", "5", "--sigma", "2")
    again = run(tmp_path / "b", "--recording", str(tmp_path / "a" / "recording.npz"))
    same_beliefs(tmp_path / "a", tmp_path / "b")
    assert again["truth"] == "pyramid"
    run(tmp_path / "c", "--recording", str(tmp_path / "b" / "recording.npz"))
    same_beliefs(tmp_path / "a", tmp_path / "c")
    cut = run(tmp_path / "d", "--recording", str(tmp_path / "a" / "recording.npz"), "--seconds", "0.3")
    assert cut["explored_seconds"] == pytest.approx(0.3)


@pytest.mark.parametrize(
    "jitter",
    [["--rotation-jitter", "180", "--size-jitter", "0.2"], ["--yaw-jitter", "40"], ["--position-jitter", "0.01"]],
    ids=lambda flags: flags[0],
)
@pytest.mark.parametrize("hand", ["two_finger", "two_finger_arm"])
def test_how_far_the_object_may_lie_otherwise_is_played_back(tmp_path: Path, hand: str, jitter: list[str]) -> None:
    run(tmp_path / "a", "--hand", hand, "--shape", "cube", "--seconds", "0.6", "--seed", "900002", *jitter)
    run(tmp_path / "b", "--recording", str(tmp_path / "a" / "recording.npz"))
    same_beliefs(tmp_path / "a", tmp_path / "b")


@pytest.mark.parametrize("said", ["ellipsoid(1, 1, 1.3)", "cube(size=0.04)"])
@pytest.mark.parametrize("felt", ["torus(0.4)", "cube"])
def test_what_was_felt_is_the_truth_whatever_shape_is_said(tmp_path: Path, felt: str, said: str) -> None:
    run(tmp_path / "a", "--shape", felt, "--seconds", "0.3", "--particles", "1")
    summary = run(tmp_path / "b", "--recording", str(tmp_path / "a" / "recording.npz"), "--shape", said)
    assert summary["truth"] == felt
    assert {felt, said} <= set(summary["posterior"])


@pytest.mark.parametrize("hand", [["two_finger_arm"], ["adroit", "--wrist", "free"]], ids=str)
def test_a_hand_on_a_wrist_that_moves_is_played_back(tmp_path: Path, hand: list[str]) -> None:
    run(tmp_path / "a", "--hand", *hand, "--shape", "cube", "--seconds", "0.3")
    run(tmp_path / "b", "--recording", str(tmp_path / "a" / "recording.npz"))
    same_beliefs(tmp_path / "a", tmp_path / "b")


def test_motion_capture_is_followed_and_played_back(tmp_path: Path, captured: str) -> None:
    first = run(tmp_path / "a", "--recording", captured, "--shape", "cube", "--seed", "3", drawn=True)
    assert first["explored_seconds"] == pytest.approx(39 * 0.02)
    assert first["truth"] == "cube"
    assert first["touching_share"] > 0.1
    with np.load(tmp_path / "a" / "explore.npz") as trace:
        np.testing.assert_allclose(trace["true_angles"], closing().joint_angles[1:])
        assert not trace["torques"].any()
        assert float(trace["grid_resolution"]) == replay.VOXEL
    run(tmp_path / "b", "--recording", str(tmp_path / "a" / "recording.npz"))
    same_beliefs(tmp_path / "a", tmp_path / "b")


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What stands in figures that are saved."""
    texts: list[str] = []
    save = Figure.savefig

    def keep(figure: Figure, *place: Any, **more: Any) -> None:
        texts.extend(each.get_text() for each in figure.findobj(Text))
        save(figure, *place, **more)

    monkeypatch.setattr(Figure, "savefig", keep)
    return texts


def test_a_recording_without_an_object_drives_the_hand(
    tmp_path: Path, capsys: pytest.CaptureFixture, written: list[str]
) -> None:
    whole = closing()
    alone = Recording("made", whole.time, whole.joint_names, whole.joint_angles)
    recordings.write(tmp_path / "alone.npz", alone)
    summary = run(tmp_path / "a", "--recording", str(tmp_path / "alone.npz"), "--shape", "sphere", drawn=True)
    told = capsys.readouterr().out
    assert {"what touch is simulated with", "sphere (simulated)"} <= set(written)
    assert not [each for each in written if "tru" in each]
    assert summary["explored_seconds"] == pytest.approx(0.5 + 39 * 0.02, abs=0.03)
    with np.load(tmp_path / "a" / "explore.npz") as trace:
        assert trace["torques"].any()
    again = run(tmp_path / "b", "--recording", str(tmp_path / "a" / "recording.npz"))
    same_beliefs(tmp_path / "a", tmp_path / "b")
    for each, said in ((summary, told), (again, capsys.readouterr().out)):
        assert (each["truth"], each["correct"]) == (None, None)
        assert (each["contacts"], each["simulated_object"]) == ("simulated", "sphere")
        assert "No object was recorded: contacts are simulated with a sphere, as you named it." in said
        assert re.search(r"contacts are simulated with +│ a sphere", said)
        assert "in truth" not in said


@pytest.mark.parametrize("more", [{}, {"root": closing().root}, {"object": closing().object}])
def test_angles_alone_are_not_put_on_an_object_that_nobody_named(
    tmp_path: Path, more: dict[str, Any], capsys: pytest.CaptureFixture
) -> None:
    whole = closing()
    alone = Recording("made", whole.time, whole.joint_names, whole.joint_angles, **more)
    recordings.write(tmp_path / "alone.npz", alone)
    assert explore.main(["--recording", str(tmp_path / "alone.npz"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "alone.npz: it has joint angles alone, and does not tell of an object; name the one with which" in error
    assert "--shape NAME or --mesh FILE" in error
    assert error.count("\n") == 1


SETTINGS: dict[str, Any] = {
    "object": {"name": "cube", "size": [0.05] * 3, "position": [0.0] * 3, "quaternion": [1.0, 0.0, 0.0, 0.0]},
    "in_object_frame": False,
}


def explore_refuses(arguments: list[str], told: str, capsys: pytest.CaptureFixture) -> None:
    """`explore` ends with code 2 on these `arguments`, and says what is `told` in one line, whether it returns the code
    or exits with it."""
    code = None
    try:
        code = explore.main(arguments)
    except SystemExit as ended:
        code = ended.code  # type: ignore[assignment]
    error = capsys.readouterr().err
    assert code == 2
    assert told in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"object": 3}, "object must be a table of name, size, position, quaternion, got 3"),
        ({"object": {}}, "object must be a table of name, size, position, quaternion, got {}"),
        ({"object": {**SETTINGS["object"], "name": "cubee"}}, "unknown shape 'cubee'"),
        ({"object": {**SETTINGS["object"], "size": [50.0] * 3}}, "object size must lie in [0.005, 0.3] m"),
        ({"object": {**SETTINGS["object"], "position": [0.0, 1e300, 0.0]}}, "position of object must lie in [-5, 5]"),
        ({"in_object_frame": "yes"}, "in_object_frame must be True or False, got 'yes'"),
        ({"in_object_frame": True}, "it does not say where the hand and the object were"),
        ({"sigma": 1e300}, "--sigma must be a finite number in [0, 90]"),
        ({"env": "Foot"}, "unknown --env 'Foot'"),
        ({"particles": -3}, "--particles must be an integer"),
    ],
)
def test_settings_of_a_stranger_are_checked(
    tmp_path: Path, changes: dict[str, Any], told: str, capsys: pytest.CaptureFixture
) -> None:
    whole = closing()
    felt = ObserverInputs(np.zeros((40, 8)), whole.joint_angles, np.zeros((40, 50), bool))
    played = replace(whole, root=None, object=None, felt=felt, settings={**SETTINGS, **changes})
    recordings.write(tmp_path / "it.npz", played)
    explore_refuses(["--recording", str(tmp_path / "it.npz"), "--out", str(tmp_path / "out")], told, capsys)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "say what was held: --mesh FILE or --shape NAME"),
        (["--shape", "cube", "--hand", "adroit"], "the recording misses WRJ1"),
        (["--shape", "cube", "--part", "left"], "it holds one recording, no part 'left'"),
        (["--shape", "cube", "--glove-calibration", "x.toml"], "--glove-calibration is for a glove's text"),
        (["--mesh", "nowhere.stl"], "nowhere.stl"),
    ],
)
def test_what_does_not_fit_is_one_clear_line(
    tmp_path: Path, captured: str, arguments: list[str], told: str, capsys: pytest.CaptureFixture
) -> None:
    explore_refuses(["--recording", captured, "--out", str(tmp_path / "out"), *arguments], told, capsys)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--recording", "nowhere.npz"], "--recording cannot be read: "),
        (["--recording", "it.bvh"], "unknown kind of recording '.bvh'"),
        (["--part", "left"], "how to read a --recording, which is not given"),
        (["--recording", "glove.txt", "--hand", "two_finger"], "choose from adroit, myo"),
        (["--recording", "glove.txt", "--glove-calibration", "nowhere.toml"], "--recording cannot be read"),
    ],
)
def test_a_recording_that_cannot_be_read_is_one_clear_line(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit) as ended:
        explore.main(["--out", str(tmp_path), *arguments])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in error
    assert error.count("\n") == 1


def test_the_old_name_of_a_flag_is_taken_and_told(capsys: pytest.CaptureFixture) -> None:
    given = ["--recording", "nowhere.txt", "--hand", "two_finger"]
    told = []
    for flag in ("--glove-calibration", "--calibration"):
        with pytest.raises(SystemExit):
            explore.parse([*given, flag, "nowhere.toml"])
        told.append(capsys.readouterr().err.splitlines())
    new, (warning, old) = told
    assert new == [old]
    assert "'nowhere.toml'" in old
    assert "warning: --calibration is --glove-calibration now" in warning


def test_the_truth_is_what_shares_most_with_the_object() -> None:
    candidates = {name: [shapes.make(name)] for name in ("cube", "sphere")}
    assert worlds.truth_among(shapes.make("sphere"), candidates) == "sphere"
    cylinder = shapes.make("cylinder", (0.05, 0.05, 0.05))
    assert worlds.truth_among(cylinder, candidates) == "cube"


def test_a_recording_finds_its_hand() -> None:
    assert recorded.environment_of(closing()) == "HapticSLAM/TwoFinger-v0"
    other = Recording("made", np.arange(2.0), ("a",), np.zeros((2, 1)))
    with pytest.raises(ValueError, match="no hand has its joints, a; say which it is by --hand"):
        recorded.environment_of(other)
    near = replace(closing(), joint_names=("elbow", *closing().joint_names[1:]))
    with pytest.raises(ValueError, match=f"misses {closing().joint_names[0]} and has unknown elbow; the joints"):
        recorded.environment_of(near)


# Recordings of people


@people
@pytest.mark.parametrize(
    "name",
    [
        "cubemedium",
        pytest.param("spheremedium", marks=pytest.mark.statistical),
        pytest.param("cylinderlarge", marks=pytest.mark.statistical),
    ],
)
def test_people_who_inspect_objects(tmp_path: Path, name: str, capsys: pytest.CaptureFixture) -> None:
    truth = f"{SHARED}/objects/{name}.stl"
    files = f"{SHARED}/recordings/{name}_inspect.npz", "--mesh", f"{SHARED}/objects/{name}.stl"
    noisy = run(tmp_path / "noisy", "--recording", *files, "--sigma", "3", "--seed", "1")
    assert (noisy["named"], noisy["truth"]) == (truth, truth)
    errors = noisy["pose_error"]
    assert errors["haptic SLAM, lagged"]["degrees"] < 0.52 * errors["raw angles"]["degrees"]
    exact = run(tmp_path / "exact", "--recording", *files, "--sigma", "0")
    assert exact["surface"]["2 voxels"]["haptic SLAM"]["precision"] >= 0.8
    assert exact["named"] == truth
    assert noisy["contacts"] == exact["contacts"] == "simulated"
    assert "s of simulated touch" in capsys.readouterr().out
    # Told a set without the object the answer is none of these, and the pose is not pulled towards it.
    others = "--candidates", *(each for each in ("cube", "sphere", "pyramid", "cylinder") if each not in name)
    told = run(tmp_path / "wrong", "--recording", *files, "--sigma", "3", "--seed", "1", *others)
    assert (told["named"], told["truth"], told["correct"]) == ("none", "none", True)
    lagged = told["pose_error"]["haptic SLAM, lagged"]["degrees"]
    assert lagged < 1.08 * errors["haptic SLAM, lagged"]["degrees"]


@people
def test_a_small_object_has_a_map(tmp_path: Path) -> None:
    """Touched little at any one place: a map as it grows has not a voxel."""
    files = f"{SHARED}/recordings/cubemedium_inspect.npz", "--mesh", f"{SHARED}/objects/cubemedium.stl"
    small = run(tmp_path, "--recording", *files, "--scale", "0.6", "--sigma", "3", "--seed", "1")
    assert small["surface"]["2 voxels"]["haptic SLAM"]["f_score"] > 0.8


@people
@pytest.mark.parametrize(
    ("name", "scale"),
    [
        ("cubemedium", 0.6),
        pytest.param("spheremedium", 0.5, marks=pytest.mark.statistical),
        pytest.param("cylinderlarge", 0.5, marks=pytest.mark.statistical),
    ],
)
def test_a_small_object_is_named(tmp_path: Path, name: str, scale: float) -> None:
    truth = f"{SHARED}/objects/{name}.stl"
    told = "--recording", f"{SHARED}/recordings/{name}_inspect.npz", "--mesh", truth, "--scale", str(scale)
    small = run(tmp_path, *told, "--sigma", "3", "--seed", "900000", "--particles", "1")
    assert small["named"] == truth


@people
def test_a_glove_on_the_adroit_hand(tmp_path: Path) -> None:
    file = f"{SHARED}/recordings/cyberglove_ball_grasp.txt"
    summary = run(
        tmp_path, "--recording", file, "--hand", "adroit", "--shape", "sphere", "--seconds", "2.5", drawn=True
    )
    assert summary["touching_share"] > 0.05
