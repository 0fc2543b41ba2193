"""A table that was altered is taken where it means the same, and else refused by its line: never changed in silence."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from haptic_lab.files import part_of_name
from haptic_lab.sweeps.results import KEY, TEXTS, Results, listed, names_in

NUMBERS = [name for name in KEY if name not in TEXTS] + ["error"]
NAMES = ["cube", "brick [old].stl", "würfel, groß.stl", "it's.ply", 'a"b.obj', "crème brûlée/物.stl"]


def opened(folder: Path) -> Results:
    return Results(folder, {"particles": 5}, [*KEY, "error", "named"], NUMBERS, ["floor", "haptic_slam"])


def rows_of(shape: str, seed: int) -> list[dict[str, Any]]:
    constant = dict.fromkeys(NUMBERS, 0.1) | {"policy": "random_torque", "shape": shape, "seed": seed}
    return [
        constant | {"observer": "floor", "error": 1 / 3, "named": listed([shape, "cube"])},
        constant | {"observer": "haptic_slam", "error": float("nan"), "named": ""},
    ]


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """A table of three trials."""
    results = opened(tmp_path)
    for seed in range(3):
        results.append(rows_of("würfel [1].stl", seed))
    return results.path


def lines_of(text: str) -> list[str]:
    return text.splitlines(keepends=True)


SAME: dict[str, Callable[[str], str]] = {
    "Windows' ends of lines": lambda text: text.replace("\n", "\r\n"),
    "a byte order mark": lambda text: "\ufeff" + text,
    "an empty line at the end": lambda text: text + "\n",
    "empty lines between": lambda text: text.replace("\n", "\n\n"),
    "no end of the last line": lambda text: text[:-1],
    "quotes about a word": lambda text: text.replace(",random_torque,", ',"random_torque",'),
}
OTHER: dict[str, tuple[Callable[[str], str], str]] = {
    "a digit of a measure": (lambda text: text.replace("0.3333", "0.3433", 1), "line 2: it was altered"),
    "a digit of a condition": (lambda text: text.replace("0.1,", "0.7,", 1), "line 2: it was altered"),
    "a name": (lambda text: text.replace("würfel [1].stl,0", "würfel [2].stl,0", 1), "line 2: it was altered"),
    "a number as a spreadsheet has it": (lambda text: text.replace("0.1,", "0.10,", 1), "line 2: it was altered"),
    "a row doubled": (lambda text: text + lines_of(text)[-1], "line 8: the trial and observer of line 7 once more"),
    "a trial doubled": (lambda text: text + "".join(lines_of(text)[1:3]), "line 8: the trial and observer of line 2"),
    "a row lost": (lambda text: "".join(lines_of(text)[:2] + lines_of(text)[3:]), "has rows of floor"),
    "a row cut": (lambda text: text.replace("0.3333333333333333,", "", 1), "line 2: 15 fields, not 16"),
    "semicolons": (lambda text: text.replace(",", ";"), "line 1: the columns are not those"),
    "a quote": (lambda text: text.replace("random_torque,", '"random_torque,', 1), "line 2: "),
    "another table": (lambda text: "a,b\n1,2\n", "line 1: the columns are not those"),
    "nothing": (lambda text: "", "line 1: the columns are not those"),
}


@pytest.mark.parametrize("how", SAME)
def test_what_means_the_same_is_taken_and_put_back(table: Path, how: str) -> None:
    whole = table.read_bytes()
    table.write_bytes(SAME[how](whole.decode()).encode())
    assert table.read_bytes() != whole
    assert len(opened(table.parent).trials) == 3
    assert table.read_bytes() == whole


@pytest.mark.parametrize("how", OTHER)
def test_what_means_something_else_is_refused_and_left_alone(table: Path, how: str) -> None:
    alter, told = OTHER[how]
    altered = alter(table.read_bytes().decode()).encode()
    assert altered != table.read_bytes()
    table.write_bytes(altered)
    with pytest.raises(ValueError, match=r"trials\.csv") as refused:
        opened(table.parent)
    assert told in str(refused.value)
    assert table.read_bytes() == altered


def test_a_table_in_another_encoding_is_refused(table: Path) -> None:
    table.write_bytes(table.read_bytes().decode().encode("latin-1"))
    with pytest.raises(ValueError, match=r"trials.csv is corrupt: .*can't decode"):
        opened(table.parent)


def test_a_trial_that_was_being_written_is_dropped_wherever_it_was_cut(table: Path) -> None:
    whole = table.read_bytes()
    last = sum(map(len, whole.splitlines(keepends=True)[:-2]))  # where the last trial begins
    for end in range(last, len(whole) - 1):
        table.write_bytes(whole[:end])
        results = opened(table.parent)
        assert len(results.trials) == 2
        assert table.read_bytes() == whole[:last]


def test_a_machine_with_other_ways_writes_and_reads_the_same_bytes(
    table: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(io, "text_encoding", lambda encoding, _=2: "latin-1" if encoding is None else encoding)
    monkeypatch.setattr("os.linesep", "\r\n")
    whole = table.read_bytes()
    results = opened(table.parent)
    results.rewrite()
    assert table.read_bytes() == whole
    assert b"\r" not in whole
    assert "würfel [1].stl" in pd.read_csv(table)["shape"].tolist()


def test_two_that_write_at_once_are_seen_by_the_third(table: Path) -> None:
    one, other = opened(table.parent), opened(table.parent)
    one.append(rows_of("cube", 7))
    other.append(rows_of("cube", 7))
    with pytest.raises(ValueError, match="line 10: the trial and observer of line 8 once more"):
        opened(table.parent)


def test_the_longest_course_is_read_again(tmp_path: Path) -> None:
    long = " ".join(["1.23456e-05"] * 4 * 3600)
    opened(tmp_path).append([row | {"named": long} for row in rows_of("cube", 0)])
    assert opened(tmp_path).trials.popitem()[1][0]["named"] == long


@pytest.mark.parametrize("names", [[], NAMES[:1], NAMES, ["nearest_neighbour", "paper+no_lag"]])
def test_names_in_a_field_are_those_that_were_listed(names: list[str]) -> None:
    assert names_in(listed(names)) == names


def test_words_in_a_field_stand_there_as_they_are() -> None:
    assert listed(["cube", "paper+no_lag", "out/a.zip"]) == "cube paper+no_lag out/a.zip"


def test_parts_of_names_are_told_apart_and_can_stand_in_any_name() -> None:
    names = [*NAMES, "a/b.stl", "b.stl", "../b.stl", "~/b.stl", "b" * 300 + ".stl", "B.stl", "con:.stl", "."]
    parts = [part_of_name(name) for name in names]
    assert parts[0] == "cube"
    assert len({each.lower() for each in parts}) == len(names)
    for each in parts:
        assert each.isascii()
        assert not set(each) & set('/\\:*?"<>|~ .')
        assert len(each) <= 40
    assert part_of_name(2.5) == "2.5"
