"""A sweep that a TOML file describes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import agents
from haptic_lab.sweeps import options

WHOLE = """
shapes = ["cube", "sphere"]
sigmas = [3, 1.5]
bias_deg = [0, 2]
seconds = 5
policy = "random_torque"
observers = ["floor"]
classifiers = []
trials = 7
calibration = true
"""


def parse(tmp_path: Path, text: str, *arguments: str):
    """What the command line makes of a file with `text`, and of flags."""
    file = tmp_path / "sweep.toml"
    file.write_text(text)
    return options.check(None, ["--config", str(file), "--out", str(tmp_path / "out"), *arguments])


@pytest.mark.parametrize("flag", ["--trials", "--repeats"])
def test_a_flag_of_two_names_is_told_as_it_was_typed(flag: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        parse(tmp_path, "", flag, "0")
    assert f": error: {flag} must be an integer in [1, 100000], got 0\n" in capsys.readouterr().err


def test_repeats_are_trials(tmp_path: Path) -> None:
    assert parse(tmp_path, "repeats = 3").trials == parse(tmp_path, "", "--repeats", "3").trials == 3


def refused(tmp_path: Path, text: str, capsys: pytest.CaptureFixture, *arguments: str) -> str:
    """The one line that is told about a file with `text`."""
    with pytest.raises(SystemExit) as ended:
        parse(tmp_path, text, *arguments)
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
    return error


def test_a_file_says_what_flags_say(tmp_path: Path) -> None:
    given = parse(tmp_path, WHOLE)
    flags = ["--shapes", "cube", "sphere", "--sigmas", "3", "1.5", "--bias-deg", "0", "2", "--seconds", "5"]
    flags += ["--observers", "floor", "--classifiers", "--trials", "7", "--calibration"]
    same = options.check(None, [*flags, "--out", str(tmp_path / "out")])
    assert given.settings == same.settings
    assert given.conditions == same.conditions
    assert [(each.sigma_deg, each.bias_deg) for each in given.conditions] == [(1.5, 0), (1.5, 2), (3, 0), (3, 2)]
    assert given.trials == same.trials == 7
    assert given.calibration


def test_flags_win_over_the_file(tmp_path: Path) -> None:
    given = parse(tmp_path, WHOLE, "--trials", "2", "--sigmas", "4", "--no-calibration", "--seconds", "1", "2")
    assert given.trials == 2
    assert not given.calibration
    assert {each.sigma_deg for each in given.conditions} == {4.0}
    assert {each.seconds for each in given.conditions} == {1.0, 2.0}
    assert given.settings.observers == ("floor",)
    assert parse(tmp_path, WHOLE, "--quick", "--out", str(tmp_path / "quick")).trials == options.QUICK["trials"]


def test_the_home_folder_may_be_meant_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    shutil.copy(Path(agents.__file__).parent / "trained.npz", tmp_path / "model.npz")
    (tmp_path / "sweep.toml").write_text("out = '~/out'\npolicy = '~/model.npz'", encoding="utf-8")
    given = options.check(None, ["--config", "~/sweep.toml"])
    assert given.out == str(tmp_path / "out")
    assert [each.policy for each in given.conditions] == [str(tmp_path / "model.npz")] * 3
    assert options.check(None, ["--config", "~/sweep.toml", "--out=~/x"]).out == str(tmp_path / "x")


def test_an_ablation_may_stand_in_the_file(tmp_path: Path) -> None:
    assert parse(tmp_path, "ablation = true").settings.observers == options.ABLATION


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("sigma = 3", "unknown key 'sigma' (did you mean 'sigmas'?); choose from ablation, attention_seconds"),
        ("[noise]\nbias_deg = 3", "unknown key 'noise'"),
        ("config = 'other.toml'", "unknown key 'config'"),
        ("trials = 3.0", "trials must be an integer, got 3.0"),
        ("trials = [3]", "trials must be an integer, got [3]"),
        ("trials = true", "trials must be an integer, got True"),
        ("sigmas = ['3']", "sigmas must be a number or a list of such, got ['3']"),
        ("sigmas = []", "sigmas must have a value, got []"),
        ("observers = []", "observers must name at least one of"),
        ("shapes = 3", "shapes must be a string or a list of such, got 3"),
        ("calibration = 'yes'", "calibration must be true or false, got 'yes'"),
        ("first_seed = -1", "first_seed must be an integer in [0, "),
        ("motor_noise = [0.1, 3]", "motor_noise must be a finite number in [0, 1], got 3"),
        ("shapes = ['egg']", "unknown shapes 'egg'; choose from cube"),
        ("policy = ['push']", "unknown policy 'push'; choose from"),
        ("ablation = true\nobservers = ['floor']", "ablation compares with haptic_slam"),
        ("trials = 3\nsigmas = 3 4", "(at line 2, column 12)"),
        ("trials = 3\ntrials = 4", "Cannot overwrite a value"),
    ],
)
def test_a_wrong_file_is_one_clear_line(text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    error = refused(tmp_path, text, capsys, "--trials", "1")
    assert f"{tmp_path / 'sweep.toml'}: " in error
    assert told in error


def test_a_file_that_is_not_there_is_told(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        options.check(None, ["--config", str(tmp_path / "none.toml")])
    assert "none.toml" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ("--policy trained --env adroit", "action Box(8,) float32, and here Box(24,) float32"),
        (
            "--policy random_torque trained --shapes cube",
            "observation Box(10,) float32, and here Box(7,) float32 (of names",
        ),
    ],
)
def test_a_model_that_does_not_fit_is_refused_before_anything_runs(
    flags: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit) as ended:
        options.check(None, [*flags.split(), "--out", str(tmp_path / "out")])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_shape_is_the_same_in_a_file_and_as_a_flag_however_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "sweep.toml"
    path.write_text('shapes = ["torus(0.40)", "cube( size=.04 )"]\n')
    plans = [["--config", str(path)], ["--shapes", "torus( .4 )", "cube(size=0.040)"]]
    assert {options.check(None, each).settings.shapes for each in plans} == {("torus(0.4)", "cube(size=0.04)")}
