"""The benchmark runs and writes figures that make sense; how fast things are is for people to read, not for a test."""

from __future__ import annotations

import json
import math
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from haptic_lab.benchmarks import side_by_side, suite, timings
from haptic_lab.benchmarks.recording import make_slam, record
from haptic_lab.benchmarks.stages import stages
from haptic_lab.commands import bench
from observer import ShapePosterior


@pytest.fixture
def one_neighbour(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other processes are busy beside the first of those measured so, and beside it alone."""
    neighbours, busy = timings.neighbours, []

    def few(count: int) -> AbstractContextManager[None]:
        busy.append(count)
        return neighbours(count if busy.count(count) == 1 else 0)

    monkeypatch.setattr(timings, "neighbours", few)


@pytest.mark.usefixtures("one_neighbour")
def test_quick_writes_sane_figures(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert bench.main(["--quick", "--rounds", "1", "--json", str(tmp_path / "bench.json")]) == 0
    told = json.loads((tmp_path / "bench.json").read_text())
    figures = {each["name"]: each for each in told["figures"]}
    assert len(figures) == len(told["figures"]), "every name once"
    assert told["settings"]["quick"] is True
    assert told["machine"]["cores"] >= 1
    for name, each in figures.items():
        assert each["unit"] in ("µs", "ms", "s", "MB", "B", "GB/s", "/s")
        assert math.isfinite(each["median"]), name
        beyond = name == "env.step beyond its mj_step calls"  # a difference: its least is not the least of its pairs
        assert each["median"] >= 0.0 or beyond
        assert each["least"] is None or beyond or each["least"] <= each["median"]
    assert {"env.step", "PoseFilter.step, alone", "HapticSLAM.step, N = 20, 16³, 1 thread"} <= set(figures)
    for size in ("N = 20, 16³", "N = 40, 16³", "N = 20, MyoHand"):  # as a user has it who says nothing
        assert {f"HapticSLAM.step, {size}", f"HapticSLAM.step, {size}, each core busy"} <= set(figures)
    assert {"HapticSLAM.step, N = 20, MyoHand, 1 thread", "a live step at 100 Hz, MyoHand"} <= set(figures)
    assert all(f"stage: {name}" in figures for name in suite.STAGES)
    assert "HapticSLAM.map_now after 1 s" in figures
    assert set(side_by_side.NAMES.values()) <= set(figures)
    assert "medians" in capsys.readouterr().out.lower()


def test_steps_of_a_learner_are_measured_alone(tmp_path: Path) -> None:
    assert bench.main(["--quick", "--rounds", "1", "--learner", "--json", str(tmp_path / "bench.json")]) == 0
    figures = json.loads((tmp_path / "bench.json").read_text())["figures"]
    assert {each["name"] for each in figures} == {"posterior, an update", *side_by_side.NAMES.values()}
    assert all(each["median"] > 0.0 for each in figures)


def test_a_hand_that_is_not_installed_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    record = suite.record

    def without_hands(env_id: str, *rest: object) -> object:
        if env_id == suite.WHOLE_HAND:
            raise ImportError("it needs the package 'myo_sim'")
        return record(env_id, *rest)

    monkeypatch.setattr(suite, "record", without_hands)
    (row,) = suite.Bench(bench.parse(["--quick"]))._of_whole_hand({})
    assert math.isnan(row.median)
    assert row.note == "skipped: it needs the package 'myo_sim'"


def test_what_was_watched_is_as_before() -> None:
    recording = record("HapticSLAM/TwoFinger-v0", "cube", 3.0, seed=0, steps=15)
    slam, shape = make_slam(recording, 5, 16), ShapePosterior(recording.hand)
    took = stages(slam, shape, recording)
    assert set(took) == set(suite.STAGES)
    assert all(each.shape == (15,) for each in took.values())
    assert slam.on_part is None


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--shape", "egg"], "unknown --shape 'egg'; choose from"),
        (["--env", "Hand-v9"], "unknown --hand or --env 'Hand-v9'"),
        (["--rounds", "0"], "--rounds must be an integer in [1, 1000]"),
        (["--sigma", "nan"], "--sigma must be a finite number"),
        (["--json", "/nowhere/at/all.json"], "--json must be a file in a folder that can be written to, got"),
    ],
)
def test_bad_input_is_one_clear_line(arguments: list[str], told: str, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        bench.parse(arguments)
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert error.count("\n") == 1
    assert told in error
