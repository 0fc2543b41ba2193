"""`haptic-slam replay` with measured touch: from another program's file to a name, a map and a picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haptic_env import hands
from haptic_lab.commands import learn, replay
from haptic_lab.exploration import measured
from tests.haptic_env import measured_files
from tests.haptic_env.measured_files import MAKERS, PARTS

pytestmark = pytest.mark.usefixtures("coarse")


def arguments(folder: Path, kind: str) -> list[str]:
    path, text = MAKERS[kind](folder)
    (folder / "map.toml").write_text(text)
    return [str(path), "--columns", str(folder / "map.toml"), *(["--part", PARTS[kind]] if kind in PARTS else [])]


def run(folder: Path, *given: str, drawn: bool = False) -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        if not drawn:
            patch.setattr(measured, "picture", lambda *_: None)
        assert replay.main([*given, "--particles", "5", "--out", str(folder / "out")]) == 0
    return json.loads((folder / "out" / "explore.json").read_text())


@pytest.mark.parametrize("kind", MAKERS)
def test_one_command_from_a_file_to_name_map_and_picture(tmp_path: Path, kind: str, capsys) -> None:
    summary = run(tmp_path, *arguments(tmp_path, kind), drawn=kind == "csv")
    told = capsys.readouterr().out
    assert summary["contacts"] == "measured"
    assert summary["named"] in summary["posterior"]
    assert (summary["truth"], summary["correct"]) == (None, None)
    assert "s of measured touch" in told
    for pretended in ("in truth", "right", "wrong", "pose error", "F-score"):
        assert pretended not in told
    with np.load(tmp_path / "out" / "explore.npz") as trace:
        assert trace["contacts"].any()
        assert np.isfinite(trace["occupancy"]).all()
    assert (tmp_path / "out" / "explore.png").exists() == (kind == "csv")


def test_what_was_replayed_is_replayed_again_to_the_same(tmp_path: Path) -> None:
    first = run(tmp_path, *arguments(tmp_path, "xdf"))
    (tmp_path / "b").mkdir()
    again = run(tmp_path / "b", str(tmp_path / "out" / "recording.npz"), "--hand", "two_finger")
    assert again["posterior"] == first["posterior"]


def test_a_gap_makes_the_belief_vaguer_and_is_told(tmp_path: Path, capsys) -> None:
    given = arguments(tmp_path, "csv")
    whole = run(tmp_path, *given)
    lines = Path(given[0]).read_text().splitlines()
    Path(given[0]).write_text("\n".join([*lines[:15], *lines[27:]]))
    capsys.readouterr()
    gap = run(tmp_path, *given)
    told = capsys.readouterr().out
    assert gap["measured"]["joints_missing"] == pytest.approx(12 / 40)
    assert gap["joint_std"] > 1.1 * whole["joint_std"]
    assert "30.0% of the joint angles" in told.replace("\n", " ").replace("  ", " ")
    assert "the longest gap is 0.24 s" in told.replace("\n", " ")
    assert (gap["joints_lost"], "may be anywhere" in told) == (0.0, False)


def test_after_a_long_silence_a_joint_is_known_as_well_as_its_range(tmp_path: Path, capsys) -> None:
    given = arguments(tmp_path, "csv")
    lines = Path(given[0]).read_text().splitlines()
    late = [
        ",".join([f"{float(first) + 3000.0:.0f}", *rest]) for first, *rest in (line.split(",") for line in lines[27:])
    ]
    Path(given[0]).write_text("\n".join([*lines[:15], *late]))
    silent = run(tmp_path, *given)
    told = capsys.readouterr().out
    assert silent["joints_lost"] > 0.5
    assert silent["joint_std"] < np.rad2deg(np.ptp(hands.make("two_finger").joint_limits, axis=1)).mean() / 12**0.5
    assert "joints that may be anywhere in their range" in told


@pytest.mark.parametrize("named", ["cube", "sphere"])
def test_an_object_that_is_named_is_what_the_user_says(tmp_path: Path, named: str, capsys) -> None:
    summary = run(tmp_path, *arguments(tmp_path, "csv"), "--object", named, "--candidates", "cube", "cylinder")
    assert summary["truth"] == named
    assert summary["correct"] == (summary["named"] == named)
    assert set(summary["posterior"]) == {"cube", "cylinder"}
    assert "you say it is" in capsys.readouterr().out


@pytest.mark.parametrize("torques", [0.0, 0.3])
def test_torques_are_told_where_there_are_any_and_nothing_else_is_asked_for(tmp_path: Path, torques: float) -> None:
    hand, time, angles, contacts = measured_files.made()
    felt = {"felt_angles": angles, "contacts": contacts, "torques": np.full(angles.shape, torques)}
    np.savez(tmp_path / "a.npz", time=time, joint_names=np.array(hand.joint_names), joint_angles=angles, **felt)
    summary = run(tmp_path, str(tmp_path / "a.npz"), "--sigma", "2")
    assert (summary["contacts"], summary["truth"]) == ("measured", None)
    with np.load(tmp_path / "out" / "explore.npz") as trace:
        np.testing.assert_allclose(trace["torques"], torques)
    if torques:
        given = str(tmp_path / "a.npz"), "--believed-bias-deg", "3", "--save-offsets", str(tmp_path / "offsets.toml")
        run(tmp_path, *given)
        assert "offset_deg" in (tmp_path / "offsets.toml").read_text()


def refuse(*given: str) -> str:
    with pytest.raises(SystemExit) as ended:
        replay.main([*given])
    assert ended.value.code == 2
    return "error"


def test_what_makes_no_sense_ends_with_one_line(tmp_path: Path, capsys) -> None:
    path, columns, place = arguments(tmp_path, "csv")
    text = Path(place).read_text()
    for more, said, changed in (
        (["--hand", "adroit"], "hand 'adroit'", text),
        ([], "say whose joints and patches it has: --hand NAME", text.replace(measured_files.HEAD, "")),
        ([], "unknown hand 'paw'", text.replace("two_finger", "paw")),
        (["--bias-deg", "3"], "--bias-deg is for angles and contacts that are simulated", text),
        (["--wrist", "free"], "--wrist is for a hand that explores", text),
        (["--part", "2"], "it holds one recording, no part '2'", text),
        ([], "expected", "a = ["),
    ):
        Path(place).write_text(changed)
        refuse(path, columns, place, "--out", str(tmp_path / "never"), *more)
        error = capsys.readouterr().err
        assert said.lower() in error.lower() or said == "expected"
        assert error.count("\n") == 1
        assert not (tmp_path / "never").exists()


def test_seconds_cut_a_recording(tmp_path: Path) -> None:
    """As if it had ended there, and so it is kept."""
    given = arguments(tmp_path, "csv")
    whole = run(tmp_path, *given)
    cut = run(tmp_path, *given, "--seconds", "0.5")
    assert whole["explored_seconds"] > 0.6
    assert cut["explored_seconds"] == pytest.approx(0.5)
    assert cut["measured"]["steps"] == 1 + round(0.5 * cut["measured"]["control_hz"])
    (tmp_path / "b").mkdir()
    again = run(tmp_path / "b", str(tmp_path / "out" / "recording.npz"), "--hand", "two_finger")
    assert again["posterior"] == cut["posterior"]
    assert run(tmp_path, *given, "--seconds", "900")["posterior"] == whole["posterior"]


@pytest.mark.parametrize("command", [replay.main, lambda told: learn.main(["it", "--recording", *told])])
def test_a_recording_takes_no_policy(tmp_path: Path, capsys, command) -> None:
    with pytest.raises(SystemExit):
        command([*arguments(tmp_path, "csv"), "--policy", "enclosure"])
    told = capsys.readouterr().err.strip().splitlines()
    assert told[-1].endswith("--policy enclosure: a recording is replayed as it moved; take --policy out")
