"""evaluate.py --recordings: many recordings, draws of the noise and sigmas in one table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import trimesh

from haptic_env import recordings
from haptic_env.recordings import Recording
from haptic_lab.commands import evaluate, explore
from haptic_lab.sweeps import options, replayed
from haptic_lab.sweeps.tasks import SweepTask
from tests.haptic_env.movements import closing

TINY = ["--observers", "floor", "haptic_slam", "--particles", "2", "--jobs", "1", "--first-seed", "7"]
pytestmark = pytest.mark.usefixtures("coarse", "serially")


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    """Motion capture, whose object is followed, and joint angles alone, which drive the hand."""
    whole = closing()
    recordings.write(tmp_path / "captured.npz", whole)
    recordings.write(tmp_path / "alone.npz", Recording("made", whole.time, whole.joint_names, whole.joint_angles))
    return [str(tmp_path / "captured.npz"), str(tmp_path / "alone.npz")]


def test_a_row_is_what_replay_makes_of_a_recording_and_the_sweep_goes_on(
    tmp_path: Path, files: list[str], capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    sweep = ["--recordings", *files, "--shapes", "sphere", "cube", "--sigmas", "2", "4", *TINY, "--out", str(out)]
    assert evaluate.main([*sweep, "--trials", "1"]) == 0
    first = pd.read_csv(out / "trials.csv")
    assert evaluate.main([*sweep, "--trials", "2"]) == 0
    assert "4 of 8 trials are in" in " ".join(capsys.readouterr().out.split())
    rows = pd.read_csv(out / "trials.csv")
    assert len(rows) == 2 * 2 * 2 * 2
    assert set(rows["contacts"]) == {"simulated"}
    assert set(rows["policy"]) == {"recording"}
    assert dict(zip(rows["recording"], rows["shape"], strict=True)) == dict(zip(files, ("sphere", "cube"), strict=True))
    pd.testing.assert_frame_equal(rows[rows["seed"] == 7].reset_index(drop=True), first)
    assert len(list(out.glob("*/evaluate.png"))) == 2, "recordings are told of apart"

    monkeypatch.setattr(explore, "picture", lambda *_: None)
    for path, shape in zip(files, ("sphere", "cube"), strict=True):
        told = ["--recording", path, "--shape", shape, "--sigma", "4", "--seed", "8", "--particles", "2"]
        assert explore.main([*told, "--out", str(tmp_path / "one")]) == 0
        one = json.loads((tmp_path / "one" / "explore.json").read_text())
        mine = rows[(rows["recording"] == path) & (rows["sigma_deg"] == 4) & (rows["seed"] == 8)].set_index("observer")
        slam = mine.loc["haptic_slam"]
        error = one["pose_error"]
        assert mine.loc["floor", "pose_error_online_deg"] == pytest.approx(error["raw angles"]["degrees"], rel=1e-12)
        assert slam["pose_error_lagged_deg"] == pytest.approx(error["haptic SLAM, lagged"]["degrees"], rel=1e-12)
        assert slam["shape_posterior"] == one["named"]
        assert slam["seconds"] == pytest.approx(one["explored_seconds"])
        assert slam["surface_f_score_2"] == pytest.approx(
            one["surface"]["2 voxels"]["haptic SLAM"]["f_score"], nan_ok=True
        )
        for label, probability in one["posterior"].items():
            assert slam[f"p_{label}"] == pytest.approx(probability, rel=1e-9)


def test_an_object_may_be_the_mesh_beside_and_none_of_the_candidates(tmp_path: Path) -> None:
    trimesh.creation.box((0.05, 0.05, 0.03)).export(tmp_path / "box.stl")
    whole = closing()
    recordings.write(
        tmp_path / "a.npz",
        Recording("made", whole.time, whole.joint_names, whole.joint_angles, whole.root, "", whole.object, "x/box.stl"),
    )
    told = ["--recordings", str(tmp_path / "a.npz"), *TINY, "--trials", "1", "--sigmas", "3", "--seconds", "0.2", "9"]
    plan = options.check(None, told)
    assert plan.settings.shapes == (str(tmp_path / "box.stl"),)
    assert [each.seconds for each in plan.conditions] == pytest.approx([0.2, 39 * 0.02]), "not longer than it is"
    out = tmp_path / "out"
    assert evaluate.main([*told, "--candidates", "cube", "sphere", "--out", str(out)]) == 0
    rows = pd.read_csv(out / "trials.csv")
    assert set(rows["new"]) == {1.0}
    np.testing.assert_allclose(rows[["p_cube", "p_sphere", "p_none"]].sum(axis=1), 1.0)
    (tmp_path / "a.npz").write_bytes((tmp_path / "a.npz").read_bytes() + b"\0")
    with pytest.raises(SystemExit):
        evaluate.main([*told, "--candidates", "cube", "sphere", "--out", str(out)])


@pytest.mark.parametrize(
    ("told", "error"),
    [
        ("captured.npz", "captured.npz: say what was held by --shapes: it names no mesh"),
        ("captured.npz captured.npz --shapes cube", "--recordings must name each recording once, got"),
        ("captured.npz --shapes cube sphere", "there are 1 recordings, got 2 objects"),
        ("captured.npz alone.npz --shapes cube sphere pyramid", "there are 2 recordings, got 3 objects"),
        ("none.npz --shapes cube", "none.npz cannot be read"),
        ("none.csv --shapes cube", "none.csv cannot be read"),
        ("captured.npz --shapes cube --hand adroit", "the recording misses"),
        ("captured.npz --shapes cube --policy coverage", "--policy is for hands that explore"),
        ("captured.npz --shapes cube --classifiers nearest_neighbour", "--classifiers learn from explorations"),
        ("captured.npz --shapes cube --size-jitter 0.1", "--size-jitter is for explorations"),
        ("captured.npz --objects ycb", "--objects is for explorations"),
        ("felt.npz --shapes cube", "felt.npz: it tells what was felt"),
        ("felt.csv --shapes cube", "felt.csv: it tells what was felt"),
        ("felt.csv --shapes cube --hand two_finger", "felt.csv: it tells what was felt"),
        ("captured.npz --shapes cube(size=9)", "size"),
    ],
)
def test_what_cannot_be_replayed_is_refused_in_a_line(
    tmp_path: Path,
    files: list[str],
    told: str,
    error: str,
    capsys: pytest.CaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    whole = closing()
    felt = recordings.ObserverInputs(np.zeros((40, 8)), whole.joint_angles, np.zeros((40, 50), dtype=bool))
    recordings.write(
        tmp_path / "felt.npz",
        Recording("made", whole.time, whole.joint_names, whole.joint_angles, felt=felt, settings={"sigma": 3.0}),
    )
    (tmp_path / "felt.csv").write_text("time,a\n0,0\n")
    with pytest.raises(SystemExit, match="2"):
        evaluate.main(["--recordings", *told.split(), *TINY, "--out", "out"])
    said = capsys.readouterr().err
    assert error in said
    assert said.rstrip().count("\n") <= 1, said
    assert not (tmp_path / "out").exists()


def test_brackets_are_blind_and_the_observer_is_told_what_the_object_may_be(files: list[str]) -> None:
    observers = ["floor", "smoother", "white", "ceiling", "haptic_slam", "one_particle", "haptic_slam+no_lag"]
    plan = options.check(None, ["--recordings", files[0], "--shapes", "cube", *TINY, "--observers", *observers])
    trial = replayed.make_trial(SweepTask(plan.settings, plan.conditions[0], "cube", 7), naming=True)
    made: dict[str, Any] = {name: run.observer for name, run in trial.observer_runs.items()}
    informed = {name: each._known is not None for name, each in made.items()}
    assert informed == dict(zip(observers, [False] * 4 + [True] * 3, strict=True))
    assert all(run.shape is not None for run in trial.observer_runs.values())
