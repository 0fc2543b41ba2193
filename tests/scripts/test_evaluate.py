"""The sweep: seeded, resumable, never of two configurations."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import trimesh

from haptic_lab.commands import evaluate
from haptic_lab.conditions import CONTACTS, DEFAULTS, UNTOLD, Condition
from haptic_lab.sweeps import executors, measures, options, results, tasks, worker

pytestmark = pytest.mark.usefixtures("coarse")
ROOT = Path(__file__).resolve().parents[2]
TINY = [
    *("--shapes", "cube", "sphere", "--sigmas", "3", "--trials", "2", "--seconds", "0.6", "--particles", "5"),
    *("--exemplars", "1", "--jobs", "1", "--observers", "floor", "haptic_slam", "--first-seed", "10"),
]


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("swept")
    assert evaluate.main([*TINY, "--out", str(folder)]) == 0
    return folder


@pytest.fixture
def copied(swept: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(swept, tmp_path / "copied"))


def refused(folder: Path, capsys: pytest.CaptureFixture, *arguments: str) -> str:
    """What is told about a command line that makes no sense."""
    with pytest.raises(SystemExit) as ended:
        options.parse(None, [*TINY, "--out", str(folder), *arguments])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert error.count("\n") == 1
    return error


def test_one_row_for_each_trial_and_observer(swept: Path) -> None:
    rows = pd.read_csv(swept / "trials.csv")
    assert len(rows) == 2 * 2 * 2
    assert not rows.duplicated(["sigma_deg", "shape", "seed", "observer"]).any()
    assert set(rows["seed"]) == {10, 11}
    assert np.isfinite(rows["pose_error_lagged_deg"]).all()
    for version in ("version_numpy", "version_mujoco", "code", "policy", "seconds", "particles"):
        assert rows[version].notna().all()
    error = rows.groupby("observer")["pose_error_lagged_deg"].mean()
    assert error["haptic_slam"] < error["floor"]


def test_the_summary_gives_intervals(swept: Path) -> None:
    summary = pd.read_csv(swept / "summary.csv")
    named = summary[(summary["measure"] == "shape_posterior_correct") & (summary["shape"] == "all")]
    assert set(named["observer"]) == {"floor", "haptic_slam"}
    assert (named["trials"] == 4).all()
    assert ((named["low"] <= named["mean"]) & (named["mean"] <= named["high"])).all()
    assert (swept / "evaluate.png").stat().st_size > 10_000


@pytest.mark.usefixtures("serially")
@pytest.mark.parametrize("where", ["within a row", "between two rows"])
def test_killed_half_way_it_goes_on_to_the_same_rows(copied: Path, swept: Path, where: str) -> None:
    whole = (swept / "trials.csv").read_bytes()
    last = whole.splitlines(keepends=True)[-1]
    (copied / "trials.csv").write_bytes(whole[:-1] if where == "within a row" else whole[: -len(last)])
    assert evaluate.main([*TINY, "--out", str(copied)]) == 0
    assert (copied / "trials.csv").read_bytes() == whole


def test_a_finished_sweep_runs_nothing_again(copied: Path, swept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(executors.LocalWorkers, "run")
    assert evaluate.main([*TINY, "--out", str(copied)]) == 0
    assert (copied / "trials.csv").read_bytes() == (swept / "trials.csv").read_bytes()


def test_two_configurations_do_not_mix(copied: Path, capsys: pytest.CaptureFixture) -> None:
    told = refused(copied, capsys, "--exemplars", "2", "--particles", "7")
    assert "exemplars is 1 there and 2 here" in told
    assert "particles is 5 there and 7 here" in told
    told = refused(copied, capsys, "--yaw-jitter", "20", "--believed-sigma", "2", "--classifiers", "random_forest")
    assert "yaw_jitter is 0.0 there and 20.0 here" in told
    assert "believed_sigma is 1.0 there and 2.0 here" in told
    assert "classifiers is" in told
    more = ["--trials", "9", "--sigmas", "1", "3", "--bias-deg", "2"]
    assert options.parse(None, [*TINY, "--out", str(copied), *more])


def test_a_corrupt_table_is_told(copied: Path, capsys: pytest.CaptureFixture) -> None:
    table = copied / "trials.csv"
    whole = table.read_text()
    assert "0.6,cube,10,floor," in whole
    table.write_text(whole.replace("0.6,cube,10,", "0.6,cube,ten,"))
    assert "seed must be a number, got 'ten'; the table is corrupt" in refused(copied, capsys)
    table.write_text(whole.replace("0.6,cube,10,floor,", "0.6,cube,10,", 1))
    assert "line 2: " in refused(copied, capsys)
    first, *rows = whole.splitlines(keepends=True)
    table.write_text("".join([first, *rows[1:]]))
    assert "has rows of haptic_slam" in refused(copied, capsys)
    table.write_bytes(b"\xff\xfe" + whole.encode())
    assert "trials.csv is corrupt" in refused(copied, capsys)
    table.write_text("a,b\n1,2\n")
    assert "the columns are not those of this table" in refused(copied, capsys)
    table.write_text(whole)
    (copied / "config.json").write_text("{")
    assert "config.json is corrupt" in refused(copied, capsys)
    (copied / "config.json").unlink()
    assert "has no config.json" in refused(copied, capsys)


def test_a_corrupt_exemplar_is_told(copied: Path, capsys: pytest.CaptureFixture) -> None:
    (copied / "trials.csv").unlink()
    exemplar = next((copied / "exemplars").iterdir())
    exemplar.write_bytes(exemplar.read_bytes()[:100])
    assert evaluate.main([*TINY, "--out", str(copied)]) == 1
    told = "".join(capsys.readouterr().out.split())
    assert f"{exemplar.name}iscorrupt" in told


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--shapes", "cube", "egg"], "unknown --shapes 'egg'; choose from cube"),
        (["--shapes", "cube", "cube"], "must name each shape once"),
        (["--size-jitter", "0.6"], "--size-jitter must be a finite number in [0, 0.5]"),
        (["--position-jitter", "1"], "--position-jitter must be a finite number in [0, 0.05] m"),
        (["--yaw-jitter", "-1"], "--yaw-jitter must be a finite number in [0, 180] degrees"),
        (["--believed-sigma", "0"], "--believed-sigma must be a finite number in [0.1, 10]"),
        (["--believed-sigma", "10", "--sigmas", "20"], "must be a finite number in (0, 90] degrees, got 200"),
        (["--classifiers", "oracle"], "unknown --classifiers 'oracle'; choose from"),
        (["--observers", "oracle"], "choose from ceiling, floor"),
        (["--sigmas", "nan"], "must be a finite number"),
        (["--trials", "0"], "must be an integer in [1, 100000]"),
        (["--jobs", "0"], "must be an integer in [1, 1024]"),
        (["--exemplars", "0"], "must be an integer in [1, 1000]"),
        (["--out", "/dev/null/here"], "--out must be a folder"),
        (["--bias-deg", "0", "-1"], "bias_deg must be a finite number in [0, 90] degrees, got -1"),
        (["--drift-deg", "nan"], "drift_deg must be a finite number"),
        (["--drift-seconds", "0"], "drift_seconds must be a finite number"),
        (["--proportional", "2"], "proportional must be a finite number in [0, 1], got 2"),
        (["--motor-noise", "-0.1"], "motor_noise must be a finite number"),
        (["--contact-miss", "0.1", "1.5"], "contact_miss must be a finite number in [0, 1], got 1.5"),
        (["--contact-false-alarm", "2"], "contact_false_alarm must be a finite number in [0, 1], got 2"),
        (["--policy", "random_torque", "push"], "unknown --policy 'push'; choose from"),
        (["--seconds", "1", "0"], "--seconds must be a finite number"),
    ],
)
def test_bad_input_is_one_clear_line(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    assert told in refused(tmp_path, capsys, *arguments)


@pytest.mark.usefixtures("serially")
def test_variants_are_observers_too(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    few = [*TINY, "--seconds", "0.3", "--trials", "1", "--observers", "haptic_slam", "one_particle"]
    assert evaluate.main([*few, "--ablation", "--calibration", "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "one_particle" in told
    assert {"ablation.csv", "ablation.png", "calibration.csv", "calibration_one_particle.png", "summary.csv"} <= {
        each.name for each in tmp_path.iterdir()
    }
    rows = pd.read_csv(tmp_path / "trials.csv").set_index("observer")
    assert (rows.loc["one_particle", "n_eff"] == 1).all()
    for _, row in rows.iterrows():
        counts = np.array(row["ranks_lagged"].split(), dtype=int)
        assert counts.sum() == 15 * 8
        middle = counts[2:38].sum() / counts.sum()
        assert middle == pytest.approx(row["coverage_90_lagged"])
        for names, measure in ((measures.CELLS, "occupancy_ece"), (measures.SKIN_CELLS, "skin_ece")):
            cells, said, found = (np.array(row[name].split(), dtype=float) for name in names)
            assert np.nansum(np.abs(said - found) * cells) / cells.sum() == pytest.approx(row[measure], rel=1e-3)


def test_an_ablation_needs_the_full_observer(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    told = refused(tmp_path, capsys, "--ablation", "--observers", "floor", "paper")
    assert "--ablation compares with haptic_slam, which is not among --observers" in told
    given = options.check(None, ["--shapes", "cube", "--ablation", "--out", str(tmp_path)])
    assert given.settings.observers == options.ABLATION


def task_of(condition: Mapping[str, object] | None = None, **changed: object) -> tasks.SweepTask:
    given = {
        "env": "HapticSLAM/TwoFinger-v0",
        "particles": 2,
        "shapes": ("cube", "sphere"),
        "observers": ("floor", "haptic_slam"),
        "exemplars": 1,
        "first_seed": 0,
        "classifiers": (),
    }
    noise = Condition(**{"sigma_deg": 2.0, "seconds": 0.1, **(condition or {})})
    return tasks.SweepTask(tasks.SweepSettings(**given | changed), noise, "cube", 3)


def test_the_object_varies_as_asked() -> None:
    still, moved = (
        worker.explore([task], naming=False)[0].solid
        for task in (task_of(), task_of(size_jitter=0.2, position_jitter=0.01, yaw_jitter=30.0))
    )
    assert still.size != moved.size
    assert still.position != moved.position
    assert still.quaternion[0] == 1.0
    assert moved.quaternion[0] != 1.0
    np.testing.assert_allclose(moved.size, still.size, rtol=0.2)
    np.testing.assert_allclose(moved.position, still.position, atol=0.01)


@pytest.mark.usefixtures("serially")
def test_a_mesh_is_a_label_and_its_name_is_no_folder(tmp_path: Path) -> None:
    path = str(tmp_path / "box.stl")
    trimesh.creation.box((45, 45, 45)).export(path)
    arguments = ["--shapes", path, "sphere", "--scale", "0.001", "--trials", "1", "--hand", "two_finger"]
    assert evaluate.main([*TINY, *arguments, "--out", str(tmp_path / "out")]) == 0
    rows = pd.read_csv(tmp_path / "out" / "trials.csv")
    assert set(rows["shape"]) == {path, "sphere"}
    assert np.isfinite(rows[f"p_{path}"]).all()


@pytest.mark.parametrize("name", DEFAULTS)
def test_every_noise_reaches_the_hand(name: str) -> None:
    clear = {"drift_deg": 5.0} if name == "drift_seconds" else {}
    usual, noisy = (
        worker.explore([task_of({"seconds": 0.5, **clear, **changed})], naming=False)[0]
        for changed in ({}, {name: 0.01 if name == "drift_seconds" else 0.5})
    )
    told = "contacts" if name in CONTACTS else "felt_angles"
    assert (getattr(usual, told) != getattr(noisy, told)).any()


@pytest.mark.usefixtures("serially")
def test_a_product_is_a_row_each_and_a_row_runs_again(tmp_path: Path) -> None:
    several = ["--seconds", "0.2", "0.3", "--bias-deg", "0", "4", "--policy", "random_torque", "--trials", "1"]
    assert evaluate.main([*TINY, *several, "--classifiers", "--out", str(tmp_path)]) == 0
    rows = pd.read_csv(tmp_path / "trials.csv")
    assert len(rows) == 2 * 2 * 2 * 2
    key = [name for name in results.KEY if name not in UNTOLD]
    assert not {*UNTOLD} & {*rows}, "it is a table as from before there were any"
    assert not rows.duplicated(key).any()
    assert not list((tmp_path / "exemplars").iterdir()), "nothing learns from them"
    error = rows[rows["observer"] == "floor"].groupby("bias_deg")["pose_error_online_deg"].mean()
    assert error[4.0] > error[0.0]
    summary = pd.read_csv(tmp_path / "summary.csv")
    assert len(summary[["bias_deg", "seconds"]].drop_duplicates()) == 4
    assert summary["trials"].max() == 2
    assert (tmp_path / "bias_deg=4.0,seconds=0.2" / "evaluate.png").exists()

    told = rows.iloc[-2]
    condition = Condition(**{each.name: told[each.name] for each in fields(Condition) if each.name in told})
    names = {"shapes": tuple(told["candidates"].split()), "observers": tuple(told["observers"].split())}
    plain = {
        each.name: told[each.name]
        for each in fields(tasks.SweepSettings)
        if each.name in told and each.name not in (*names, "classifiers")
    }
    settings = tasks.SweepSettings(**plain, **names, classifiers=())
    (again,) = worker.run_trials([tasks.SweepTask(settings, condition, told["shape"], int(told["seed"]))], ())
    for name in (*key, *measures.MEASURES):
        np.testing.assert_equal(again[0][name], told[name], err_msg=name)


def test_trials_that_differ_in_sigma_alone_are_run_together_and_come_out_the_same() -> None:
    noises = {"bias_deg": 2.0, "drift_deg": 2.0, "proportional": 0.1, "contact_miss": 0.2, "contact_false_alarm": 0.01}
    several = [
        task_of({"sigma_deg": sigma, "seconds": 0.6, **noises}, observers=("floor", "haptic_slam", "ceiling"))
        for sigma in (4.0, 1.0, 2.5)
    ]
    (bundle,) = tasks.bundles(several)
    assert bundle == tuple(several)
    together = worker.run_trials(bundle, (), (), ())
    for task, rows in zip(several, together, strict=True):
        np.testing.assert_equal(worker.run_trials([task], ()), [rows])
    errors = [rows[0]["pose_error_online_deg"] for rows in together]
    assert errors[1] < errors[2] < errors[0]


@pytest.mark.parametrize(
    "changed", [{"condition": {"policy": "enclosure"}}, {"condition": {"bias_deg": 1.0}}, {"particles": 3}]
)
def test_what_differs_in_more_or_heeds_what_it_feels_is_run_apart(changed: dict[str, Any]) -> None:
    condition = changed.pop("condition", {})
    one = task_of(condition, **changed)
    policy = condition.get("policy", "random_torque")
    other = task_of({"sigma_deg": 3.0, "policy": policy})
    assert tasks.bundles([one, other]) == [(one,), (other,)]


def test_observers_may_be_told_another_sigma_than_the_true_one() -> None:
    usual, misled = task_of(believed_sigma=1), task_of(believed_sigma=3)
    (world, told), (same, mistold) = (worker.explore([task], naming=False) for task in (usual, misled))
    right, wrong = told[usual], mistold[misled]
    np.testing.assert_array_equal(world.felt_angles, same.felt_angles)
    np.testing.assert_allclose(right["floor"].joint_std, np.deg2rad(2.0))
    np.testing.assert_allclose(wrong["floor"].joint_std, np.deg2rad(6.0))
    assert (wrong["haptic_slam"].joint_angles != right["haptic_slam"].joint_angles).any()


def test_the_name_after_a_while_is_that_of_its_time() -> None:
    """Right from 2 s on, wrong from 5 s on."""
    seconds = 0.02 * np.arange(1, 301)
    right = (seconds >= 2 - 1e-9) & (seconds < 5 - 1e-9)
    trace = SimpleNamespace(labels=("sphere", "cube"), posterior=np.stack([1.0 * ~right, 1.0 * right], axis=1))
    exploration = SimpleNamespace(seconds=seconds, solid=SimpleNamespace(name="cube"))
    found = [measures.correct_after(exploration, trace, after) for after in (1.98, 2, 4.98, 5, 6, 10)]
    np.testing.assert_array_equal(found, [0.0, 1.0, 1.0, 0.0, 0.0, np.nan])


def test_ctrl_c_keeps_every_finished_trial(tmp_path: Path) -> None:
    many = [each if each != "2" else "500" for each in TINY]
    command = [sys.executable, str(ROOT / "scripts" / "evaluate.py"), *many, "--out", str(tmp_path)]
    table = tmp_path / "trials.csv"
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
    ) as run:
        while not table.exists() or table.read_text(encoding="utf-8").count("\n") <= 4:
            assert run.poll() is None
            time.sleep(0.1)
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does
        told, _ = run.communicate()
    assert run.returncode == 130
    assert "Traceback" not in told
    assert "Stopped; every finished trial is kept" in told
    rows = pd.read_csv(table)
    assert len(rows) >= 4
    assert (rows.groupby(["sigma_deg", "shape", "seed"]).size() == 2).all()
