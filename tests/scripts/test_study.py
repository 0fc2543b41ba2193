"""The command that does an experiment with the observers that was done with people."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from haptic_lab.commands import study
from haptic_lab.people.studies import presets
from observer import threads

pytestmark = pytest.mark.usefixtures("coarse", "serially")

MINE = """
title = "Size"
task = "discrimination"
about = "Which is larger?"
parameter = "edge"
standard = 1.0
stimuli = [[1.0, "cube(size=0.05)"], [1.05, "cube(size=0.0525)"], [1.1, "cube(size=0.055)"], [1.2, "cube(size=0.06)"]]
differs = ["nobody was asked"]

[sweep]
sigmas = [8.0]
seconds = [0.3]
trials = 4
first_seed = 900000
observers = ["floor"]

[[published]]
value = 1.07
what = "lengths"
source = "Somebody 1900"
"""
NAMED = """
title = "Two bodies"
task = "identification"
about = "Which is it?"
after = [0.25, 0.5]

[sweep]
shapes = ["cube", "sphere"]
sigmas = [3.0]
seconds = [0.5]
trials = 1
first_seed = 900000
observers = ["haptic_slam"]

[[condition]]
name = "both fingers"

[[condition]]
name = "one finger"
moves = ["index_*"]
feels = ["index_*"]
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(MINE, encoding="utf-8")
    (tmp_path / "damaged" / "trials" / "all").mkdir(parents=True)
    (tmp_path / "damaged" / "trials" / "all" / "trials.csv").write_bytes(b"shape,seed\n\xff,1\n")
    (tmp_path / "named.toml").write_text(NAMED, encoding="utf-8")
    return tmp_path


def test_thresholds_beside_what_was_published(here: Path, capsys: pytest.CaptureFixture) -> None:
    assert study.main(["mine.toml", "--out", "out"]) == 0
    told = capsys.readouterr().out
    assert "Published: 1.07, lengths [Somebody 1900; as cited in the issue]" in told
    assert "Does not fit: nobody was asked" in told
    assert "raw angles (floor)" in told
    counts = pd.read_csv(here / "out" / "counts.csv")
    assert counts["value"].tolist() == [1.05, 1.1, 1.2]
    assert counts["trials"].tolist() == [4, 4, 4]
    assert len(pd.read_csv(here / "out" / "study.csv")) == 1
    assert (here / "out" / "study.png").stat().st_size > 1000
    kept = (here / "out" / "trials" / "all" / "trials.csv").read_bytes()
    assert study.main(["mine.toml", "--out", "again", "--trials-of", "out"]) == 0
    assert (here / "again" / "counts.csv").read_bytes() == (here / "out" / "counts.csv").read_bytes()
    assert study.main(["mine.toml", "--out", "out", "--trials", "2"]) == 0  # which are there
    assert "are in" in capsys.readouterr().out
    assert (here / "out" / "trials" / "all" / "trials.csv").read_bytes() == kept


def test_names_in_each_condition(here: Path, capsys: pytest.CaptureFixture) -> None:
    assert study.main(["named.toml", "--out", "out"]) == 0
    lines = pd.read_csv(here / "out" / "study.csv")
    assert lines["condition"].tolist() == ["both fingers"] * 2 + ["one finger"] * 2
    assert lines["after"].tolist() == [0.25, 0.5] * 2
    assert (lines["trials"] == 2).all()
    assert "one finger" in capsys.readouterr().out
    touched = [pd.read_csv(path)["touching_share"].mean() for path in sorted(here.glob("out/trials/*/trials.csv"))]
    assert touched[0] > touched[1]


def test_a_staircase_goes_on_from_what_it_asked_before(here: Path, capsys: pytest.CaptureFixture) -> None:
    before = threads.limit(3)
    try:
        assert study.main(["mine.toml", "--adaptive", "--trials", "3", "--out", "out"]) == 0
    finally:
        assert threads.limit(before) == 3, "whoever goes on in this process has fewer threads"
    first = pd.read_csv(here / "out" / "answers.csv")
    kept = len(pd.read_csv(here / "out" / "adaptive" / "all" / "trials.csv"))
    assert kept == 6
    assert study.main(["mine.toml", "--adaptive", "--trials", "4", "--out", "out"]) == 0
    assert pd.read_csv(here / "out" / "answers.csv")[:3].equals(first)
    assert len(pd.read_csv(here / "out" / "adaptive" / "all" / "trials.csv")) == kept + 2
    assert "floor" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ([], "name a study: angle, aspect_ratio"),
        (["aspect"], "unknown study 'aspect' (did you mean 'aspect_ratio'?); choose from angle"),
        (["gone.toml"], "the study 'gone.toml' cannot be read"),
        (["mine.toml", "--sigmas", "-1"], "--sigmas"),
        (["mine.toml", "--observers", "people"], "--observers"),
        (["mine.toml", "--trials-of", "elsewhere"], "--trials-of must be the --out of a study mine"),
        (["mine.toml", "--trials-of", "damaged"], "is no table of a sweep"),
        (["named.toml", "--adaptive"], "--adaptive finds thresholds"),
        (["mine.toml", "--adaptive", "--trials", "0"], "--trials"),
        (["mine.toml", "--adaptive", "--trials-of", "."], "not with --trials-of"),
    ],
)
def test_what_makes_no_sense_is_told_in_one_line(
    here: Path, arguments: list[str], why: str, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit) as ended:
        study.main([*arguments, *(["--out", "out"] if arguments else [])])
    told = capsys.readouterr().err
    assert ended.value.code == 2
    assert why in told
    assert told.count("\n") == 1
    assert not (here / "out").exists()


def test_all_that_ships_is_listed(capsys: pytest.CaptureFixture) -> None:
    assert study.main(["--list"]) == 0
    told = capsys.readouterr().out
    assert all(name in told for name in presets.names())
    assert "1.03, elliptical from circular" in told
