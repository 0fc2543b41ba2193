"""Sets of objects, and objects that are none of the candidates, in the commands."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from haptic_env import shapes
from haptic_lab.commands import bench, evaluate, explore, train
from haptic_lab.style import titles_of
from haptic_lab.sweeps import options

pytestmark = pytest.mark.usefixtures("coarse")
SET = '[objects]\nmine = "cube"\negg = { shape = "ellipsoid(1, 1, 1.3)", size = 0.06 }\n'
TINY = [
    *("--sigmas", "3", "--trials", "1", "--seconds", "0.6", "--particles", "3", "--exemplars", "1"),
    *("--observers", "haptic_slam", "--jobs", "1"),
]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "set.toml").write_text(SET)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(parse: object, arguments: list[str], capsys: pytest.CaptureFixture) -> str:
    with pytest.raises(SystemExit) as ended:
        parse(arguments)  # type: ignore[operator]
    error = str(capsys.readouterr().err)
    assert ended.value.code == 2
    assert error.count("\n") == 1
    return error


@pytest.mark.parametrize("flags", [["--objects", "set.toml"], ["--shapes", "set.toml"]])
def test_a_sweep_explores_a_set(flags: list[str]) -> None:
    plan = options.check(None, flags)
    assert plan.settings.shapes == plan.settings.known == ("set.toml:mine", "set.toml:egg")


def test_sets_and_shapes_stand_side_by_side() -> None:
    plan = options.check(
        None, ["--shapes", "set.toml", "torus", "--candidates", "four", "set.toml:egg", "--none", "0.1"]
    )
    assert plan.settings.shapes == ("set.toml:mine", "set.toml:egg", "torus")
    assert plan.settings.labels == (*shapes.SETS["four"], "set.toml:egg", "none")
    assert [plan.settings.right_name(each) for each in plan.settings.shapes] == ["none", "set.toml:egg", "none"]


@pytest.mark.parametrize(
    ("file", "flags", "explored"),
    [
        ('objects = "set.toml"', ["--shapes", "cube"], ("cube",)),
        ('shapes = ["cube"]', ["--objects", "set.toml"], ("set.toml:mine", "set.toml:egg")),
        ('objects = "set.toml"', [], ("set.toml:mine", "set.toml:egg")),
        ('shapes = ["four", "torus( .4)"]', [], (*shapes.SETS["four"], "torus(0.4)")),
    ],
)
def test_flags_win_over_a_file(here: Path, file: str, flags: list[str], explored: tuple[str, ...]) -> None:
    (here / "sweep.toml").write_text(file)
    assert options.check(None, ["--config", "sweep.toml", *flags]).settings.shapes == explored


@pytest.mark.parametrize(
    ("flags", "why"),
    [
        (["--objects", "set.toml", "--shapes", "cube"], "say one of them"),
        (["--objects", "five"], "unknown set of objects 'five'"),
        (["--objects", "gone.toml"], "'gone.toml' cannot be read"),
        (["--shapes", "set.toml:eg"], "did you mean 'egg'"),
        (["--candidates", "cube", "cube"], "--candidates must name each candidate once"),
        (["--candidates", "cubee"], "unknown --candidates 'cubee'"),
        (["--none", "1.5"], "--none must be"),
    ],
)
def test_what_makes_no_sense_is_refused(flags: list[str], why: str, capsys: pytest.CaptureFixture) -> None:
    assert why in refused(lambda given: options.check(None, given), flags, capsys)


def test_what_a_set_says_anew_is_another_sweep(here: Path, serially: None, capsys: pytest.CaptureFixture) -> None:
    given = [*TINY, "--classifiers", "--objects", "set.toml", "--out", "out"]
    assert evaluate.main(given) == 0
    (here / "set.toml").write_text(SET.replace("0.06", "0.05"))
    assert "file set.toml:egg is" in refused(lambda told: options.parse(None, told), given, capsys)


def test_a_sweep_scores_new_objects_as_new(here: Path, serially: None) -> None:
    explored = ["--shapes", "set.toml:mine", "torus", "--candidates", "set.toml:mine", "sphere", "--none", "0.2"]
    assert evaluate.main([*TINY, *explored, "--calibration", "--out", "out"]) == 0
    rows = pd.read_csv(here / "out" / "trials.csv").set_index("shape")
    labels = ["set.toml:mine", "sphere", "none"]
    said = rows[[f"p_{label}" for label in labels]].to_numpy()
    assert said.sum(axis=1) == pytest.approx(1.0)
    named = dict(zip(rows.index, (labels[best] for best in said.argmax(axis=1)), strict=True))
    right = {"set.toml:mine": "set.toml:mine", "torus": "none"}
    for shape, name in right.items():
        row = rows.loc[shape]
        assert row["shape_posterior"] == named[shape]
        assert row["shape_posterior_correct"] == (named[shape] == name)
        assert row["new"] == (name == "none")
        assert row["new_correct"] == ((named[shape] == "none") == (name == "none"))
        assert row["correct_2s"] != row["correct_2s"], "it took less"
        if named[shape] == name:
            assert row["step_accuracy"] > 0
    assert rows.loc["torus", "nearest_neighbour_correct"] == 0
    assert set(rows["candidates"]) == {"set.toml:mine sphere"}
    measures = pd.read_csv(here / "out" / "summary.csv")["measure"]
    assert {"new_correct", "new_auroc", "name_ece"} <= set(measures)


def test_objects_that_are_no_candidates_are_never_right_without_none(here: Path, serially: None) -> None:
    explored = ["--shapes", "torus", "--candidates", "cube", "sphere", "--classifiers"]
    assert evaluate.main([*TINY, *explored, "--out", "out"]) == 0
    (row,) = pd.read_csv(here / "out" / "trials.csv").to_dict("records")
    assert row["shape_posterior_correct"] == row["step_accuracy"] == 0
    assert {float(each) for each in str(row["course_p"]).split()} == {0.0}
    assert "new" not in row


def test_an_exploration_among_a_set(here: Path) -> None:
    settings, _ = explore.parse(["--objects", "set.toml", "--shape", "egg"])
    assert settings.shape == "set.toml:egg"
    assert explore.parse(["--objects", "set.toml", "--shape", "cone"])[0].shape == "cone"
    few = ["--seconds", "0.2", "--particles", "2"]
    assert explore.main(["--objects", "set.toml", "--none", "0.1", *few, "--out", "out"]) == 0
    told = json.loads((here / "out" / "explore.json").read_text())
    assert list(told["posterior"]) == ["set.toml:mine", "set.toml:egg", "none"]
    assert told["truth"] in ("set.toml:mine", "set.toml:egg")


@pytest.mark.parametrize(
    ("command", "flags", "why"),
    [
        (explore, ["--objects", "set.toml", "--candidates", "cube"], "say one of them"),
        (explore, ["--objects", "sett"], "unknown set of objects"),
        (train, ["--objects", "set.toml", "--shapes", "cube"], "say one of them"),
        (train, ["--shapes", "cube", "cube"], "each shape once"),
        (bench, ["--objects", "fifti"], "did you mean 'fifty'"),
    ],
)
def test_other_commands_refuse(command: object, flags: list[str], why: str, capsys: pytest.CaptureFixture) -> None:
    assert why in refused(command.parse, flags, capsys)  # type: ignore[attr-defined]


def test_other_commands_take_sets() -> None:
    preset, _ = train.parse(["--shapes", "set.toml", "torus"])
    assert preset.world.shapes == ("set.toml:mine", "set.toml:egg", "torus")
    assert bench.parse(["--objects", "twelve", "--shape", "torus(0.4)"]).objects == "twelve"


def test_titles_are_what_a_set_calls_its_objects() -> None:
    assert titles_of(["a.toml:mug", "cup.stl(scale=2)", "cube"]) == {
        "a.toml:mug": "mug",
        "cup.stl(scale=2)": "cup",
        "cube": "cube",
    }
    assert titles_of(["a.toml:mug", "b.toml:mug"]) == {each: each for each in ("a.toml:mug", "b.toml:mug")}
