"""The commands that fit, compare, design and simulate, on the example that ships."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from haptic_lab.commands import compare, design, fit, simulate
from haptic_lab.people import options, stopping
from haptic_lab.people.courses import Courses
from haptic_lab.people.trials import read_trials

ONE = ["example", "--courses", "example", "--subjects", "simulated 1"]


def test_the_example_ships_is_small_and_is_called_simulated():
    table, courses = read_trials(options.SHIPPED["table"]), Courses.load(options.SHIPPED["courses"])
    assert table["subject"].str.startswith("simulated").all()
    assert {f"true_{name}" for name in ("sigma_deg", "memory_seconds", "lapse")} <= set(table)
    assert set(table["object"]) == set(courses.objects) == set(courses.names)
    assert table["seconds"].max() <= courses.seconds[-1]
    assert sum(path.stat().st_size for path in options.SHIPPED.values()) < 300_000


def test_a_table_is_simulated_as_its_seed_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    flags = ["--courses", "example", "--sigma", "3", "9", "--lapse", "0.1", "--subjects", "2", "--trials", "20"]
    for name, seed in (("a.csv", "4"), ("b.tsv", "4"), ("c.csv", "5")):
        assert simulate.main([*flags, "--seed", seed, "--out", name]) == 0
    one, same, other = (read_trials(name) for name in ("a.csv", "b.tsv", "c.csv"))
    assert one.equals(same)
    assert not one.equals(other)
    assert list(one.groupby("subject").size()) == [20, 20]
    assert one["true_sigma_deg"].between(3.0, 9.0).all()
    assert one["true_sigma_deg"].nunique() == 2
    assert simulate.main([*flags, "--stop-at", "0.8", "--out", "d.csv"]) == 0
    assert "response_time" in read_trials("d.csv")


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ("--trials 3", "1 simulated subject, 3 trials, "),
        ("--subjects 2 --trials 1", "2 simulated subjects, 1 trial each, "),
    ],
)
def test_what_was_simulated_is_counted(flags: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    out = str(tmp_path / "a.csv")
    assert simulate.main(["--courses", "example", "--sigma", "3", *flags.split(), "--out", out]) == 0
    assert f"\n{told}" in capsys.readouterr().out


@pytest.mark.parametrize("command", [compare, design])
def test_models_that_cannot_be_compared_are_not_offered(command, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit):
        command.main(["--help"])
    told = " ".join(capsys.readouterr().out.split())
    assert "of ideal, memory, noise, lapse, limits, all, or NAME=FILE" in told


def test_a_fit_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.chdir(tmp_path)
    flags = ["--model", "lapse", "--draws", "2", "--out", "fit"]
    assert fit.main([*ONE, *flags]) == 0
    found = pd.read_csv("fit/fit.csv")
    assert list(found["parameter"]) == ["sigma_deg", "lapse"]
    assert (found["low"] < found["estimate"]).all()
    assert (found["estimate"] < found["high"]).all()
    predicted = pd.read_csv("fit/predicted.csv")
    assert predicted["trials"].sum() == 120
    assert predicted["expected"].between(0.0, 1.0).all()
    content = json.loads(Path("fit/fit.json").read_text())
    assert sum(content["posteriors"]["simulated 1"]["lapse"]["probability"]) == pytest.approx(1.0)
    assert {path.name for path in Path("fit").glob("[!.]*")} == {"fit.csv", "fit.json", "fit.png", "predicted.csv"}
    assert "95 % intervals" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("answer", "guesses", "cut"),
    [
        ("the object", False, "sigma_deg at 2 (of simulated 1)"),
        ("cuboid(1, 1, 1)", True, "lapse at 0.3 (of simulated 1)"),
    ],
)
def test_where_a_fit_says_nothing_is_told(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    answer: str,
    guesses: bool,
    cut: str,
):
    monkeypatch.chdir(tmp_path)
    table = pd.read_csv(options.SHIPPED["table"]).query("subject == 'simulated 1'")
    table.assign(response=table["object"] if answer == "the object" else answer).to_csv("one.csv", index=False)
    flags = ["one.csv", "--courses", "example", "--draws", "0"]
    assert fit.main([*flags, "--model", "lapse"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert cut in told
    said = "guesses, -1.386 nats a trial, explain simulated 1 better than this"
    assert (said in told) == guesses
    assert compare.main([*flags, "--models", "ideal", "lapse"]) == 0
    assert (said in " ".join(capsys.readouterr().out.split())) == guesses


def test_who_answers_when_it_likes_is_told_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    flags = ["--courses", "example", "--sigma", "5", "--trials", "40", "--seconds", "5", "--out"]
    for rule in (["--stop-at", "0.1"], ["--price", "5"]):  # at once: but not before anything was felt
        assert simulate.main([*flags, "once.csv", *rule]) == 0
        assert set(read_trials("once.csv")["seconds"]) == {Courses.load(options.SHIPPED["courses"]).seconds[0]}
    assert simulate.main([*flags, "sure.csv", "--stop-at", "0.8"]) == 0
    capsys.readouterr()
    said = "answered before being asked"
    for model, told in (("ideal", True), ("stop_at", False)):
        held = ["--sigma", "5", "--lapse", "0", *(["--stop-at", "0.7", "0.9"] if model == "stop_at" else [])]
        assert fit.main(["sure.csv", "--courses", "example", "--draws", "0", "--model", model, *held]) == 0
        assert (said in " ".join(capsys.readouterr().out.split())) == told
    predicted = pd.read_csv("out/fit/predicted.csv")
    sure, edges = read_trials("sure.csv"), stopping.SHARES * Courses.load(options.SHIPPED["courses"]).seconds[-1]
    right = sure["object"] == sure["response"]
    for name, lines in predicted.groupby("object"):
        by_then = [float((right & (sure["seconds"] <= edge + 1e-6))[sure["object"] == name].mean()) for edge in edges]
        assert list(lines["right"]) == pytest.approx(by_then)
        assert by_then[0] < by_then[-1]
    assert predicted["expected"].between(0.0, 1.0).all()


def test_what_is_told_is_held_and_what_is_ranged_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    assert fit.main([*ONE, "--draws", "0", "--sigma", "4", "--memory-seconds", "inf", "--lapse", "0", "0.1"]) == 0
    found = pd.read_csv("out/fit/fit.csv")
    assert list(found["parameter"]) == ["lapse"]
    assert found["high"].iloc[0] <= 0.1


def test_a_comparison_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    Courses.load(options.SHIPPED["courses"]).save("other.npz")
    flags = ["--models", "ideal", "lapse", "other=other.npz", "--draws", "0", "--recovery", "1", "--out", "compared"]
    assert compare.main([*ONE, *flags]) == 0
    found = pd.read_csv("compared/compare.csv")
    assert set(found["model"]) == {"ideal", "lapse", "other"}
    assert found["difference"].max() == 0.0
    same = found.set_index("model")["nats"]
    assert same["ideal"] == pytest.approx(same["other"])
    recovery = pd.read_csv("compared/recovery.csv")
    assert recovery.groupby("true")["subjects"].sum().tolist() == [1, 1, 1]
    assert Path("compared/compare.png").stat().st_size > 5000


def test_a_design_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.chdir(tmp_path)
    flags = ["--courses", "example", "--most", "20", "--rounds", "2", "--out", "designed"]
    assert design.main(["ideal", "lapse", *flags]) == 0
    assert list(pd.read_csv("designed/design.csv")["trials"]) == [10, 13, 16, 20]
    assert "Power 0.8: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("main", "arguments", "words"),
    [
        (fit.main, [*ONE, "--model", "idle"], "'idle'"),
        (fit.main, [*ONE, "--sigma", "1"], "--sigma, where"),
        (fit.main, [*ONE, "--lapse", "0.1", "0.2", "0.3"], "--lapse"),
        (fit.main, [*ONE, "--draws", "-1"], "--draws"),
        (fit.main, ["missing.csv", "--courses", "example"], "missing.csv"),
        (fit.main, ["example", "--courses", "missing.npz"], "missing.npz"),
        (fit.main, ["example", "--courses", "example", "--subjects", "nobody"], "nobody"),
        (compare.main, [*ONE, "--models", "ideal"], "2 at least"),
        (compare.main, [*ONE, "--models", "ideal", "=x"], "'=x'"),
        (compare.main, [*ONE, "--models", "ideal", "mine"], "choose from all, ideal, lapse, limits, memory, noise\n"),
        (compare.main, [*ONE, "--models", "ideal", "stop_at"], "tell when a subject answers (stop_at)"),
        (design.main, ["ideal", "mine", "--courses", "example"], "from all, ideal, lapse, limits, memory, noise\n"),
        (compare.main, [*ONE, "--recovery", "0"], "--recovery"),
        (design.main, ["ideal", "ideal", "--courses", "example"], "names of their own"),
        (design.main, ["ideal", "lapse", "--courses", "example", "--power", "1.5"], "--power"),
        (design.main, ["ideal", "lapse", "--courses", "example", "--seconds", "50"], "50"),
        (simulate.main, ["--courses", "example", "--out", "a.csv"], "--sigma"),
        (simulate.main, ["--courses", "example", "--sigma", "3", "--out", "a.txt"], "--out"),
        (simulate.main, ["--courses", "example", "--sigma", "90", "--out", "a.csv"], "90"),
        (simulate.main, ["--courses", "example", "--sigma", "3", "--seconds", "50", "--out", "a.csv"], "50"),
        (simulate.main, ["--courses", "example", "--sigma", "3", "--stop-at", "2", "--out", "a.csv"], "--stop-at must"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(
    main, arguments, words, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert words in told
    assert told.count("\n") == 1
    assert not [path for path in tmp_path.iterdir() if not path.name.startswith(".") and path.is_file()]
