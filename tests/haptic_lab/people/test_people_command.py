"""The command `people`: what it leaves behind, what it refuses, and that nothing of a stranger's runs in its report."""

from __future__ import annotations

import html as markup
import re
from pathlib import Path

import pandas as pd
import pytest

from haptic_lab.commands.people import main, parse
from haptic_lab.people.table_flags import together
from haptic_lab.people.trials import check_trials, write_trials
from tests.haptic_lab.people.beside import people, sweep

HOSTILE = "<script>alert(1)</script><img src=x onerror=alert(2)>$title\"'&"


def test_it_leaves_a_report_tables_and_pictures(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    table = people(subjects=2, each=2)
    table["subject"] = table["subject"].replace({"S0": HOSTILE, "S1": "people"})
    write_trials(table.assign(condition="[bold]$x^2$"), tmp_path / "trials.csv")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "psychometric.csv").write_text("of an earlier run")
    (tmp_path / "out" / "notes.txt").write_text("mine")
    observers = sweep(tmp_path / "sweep", {"haptic_slam": 0.9}, repeats=3)
    assert main([str(tmp_path / "trials.csv"), "--observers", str(observers), "--out", str(tmp_path / "out")]) == 0
    names = {each.name for each in (tmp_path / "out").iterdir()}
    pictures = {
        f"{name}.{kind}" for name in ("accuracy", "agreement", "confusion", "sensitivity") for kind in ("png", "pdf")
    }
    tables = {f"{name}.csv" for name in ("accuracy", "agreement", "confusion", "efficiency", "sensitivity")}
    assert names == {"report.html", "notes.txt", *pictures, *tables}
    told = capsys.readouterr().out
    assert "Efficiency" in told
    assert "[bold]$x^2$" in told or HOSTILE[:20] in told

    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    tags = set(re.findall(r"<\s*([a-zA-Z]+)", page))
    assert not tags & {"script", "iframe", "object", "embed", "link", "form", "svg", "base"}
    assert markup.escape(HOSTILE) in page
    assert not re.search(r"<[^>]*\son\w+\s*=", page)  # no handler in any tag
    assert "default-src 'none'" in page
    assert page.count("data:image/png;base64,") == len(pictures) // 2
    assert not re.search(r'(?:src|href)="(?!data:image/png)', page)
    assert "Behbahani" in page
    accuracy = pd.read_csv(tmp_path / "out" / "accuracy.csv")
    assert set(accuracy["who"]) == {"people", HOSTILE, "haptic SLAM"}


BAD = {
    "no file": (["missing.csv"], "missing.csv"),
    "no table": (["notes.txt"], "unknown ending of a table '.txt'; choose from .csv, .tsv"),
    "a map that is none": (["good.csv", "--columns", "notes.txt"], "notes.txt"),
    "a column that is not there": (["good.csv", "--column", "subject=vp"], "no column 'vp'"),
    "a unit that is none": (["good.csv", "--unit", "seconds=weeks"], "unknown unit of seconds 'weeks'"),
    "observers that are none": (["good.csv", "--observers", "."], "observers must be a folder of haptic-slam evaluate"),
    "a floor of 2": (["good.csv", "--floor", "2"], "--floor must be a finite number in [0, 1]"),
    "levels of names": (
        ["good.csv", "--level", "seconds"],
        "a column of levels ('seconds') is for answers",
    ),
    "an absent object of names": (["good.csv", "--absent", "cube"], "absent objects are those of yes and no"),
    "a table twice": (["good.csv", "numbered.csv"], "trial 2 of subject 'S0' is in two of"),
}


@pytest.mark.parametrize("fault", BAD)
def test_a_fault_ends_it_in_one_line_and_leaves_nothing(
    fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    table = check_trials(people(subjects=1, each=1))
    write_trials(table, "good.csv")
    write_trials(table.assign(trial=table["trial"] + 1), "numbered.csv")
    Path("notes.txt").write_text("no = [table")
    arguments, said = BAD[fault]
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--out", "out"])
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert said in told
    assert len(told.splitlines()) == 1
    assert not Path("out").exists()


def test_runs_of_a_subject_are_counted_through() -> None:
    run = check_trials(people(subjects=1, each=1))
    both = together([("a", run), ("b", run.assign(condition="late"))])
    assert list(both["trial"]) == list(range(1, 2 * len(run) + 1))
    assert set(both["condition"]) == {"", "late"}


def test_the_courses_that_ship_are_observers_too() -> None:
    _, table, design, observers = parse(["example", "--observers", "example"])
    assert set(design.answers) == set(table["object"]) == set(observers[0].names)
