"""Tables of trials: what is read, under which names, and what is refused with its lines and column."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from haptic_lab.people.trial_columns import TrialColumns, read_trial_columns, typed
from haptic_lab.people.trials import check_trials, read_trials, write_trials

HEADER = "subject,object,response,seconds"
GOOD = f"{HEADER}\nA,cube,sphere,2.5\nA,ellipsoid(1.10),none,3\nB,cube,cube,2\n"


def written(folder: Path, text: str | bytes, name: str = "t.csv") -> Path:
    place = folder / name
    place.write_bytes(text if isinstance(text, bytes) else text.encode())
    return place


def test_names_are_written_one_way_and_trials_are_counted_within_a_subject(tmp_path: Path) -> None:
    table = read_trials(written(tmp_path, GOOD))
    assert list(table) == [*HEADER.split(","), "trial"]
    assert list(table["object"]) == ["cube", "ellipsoid(1.1)", "cube"]
    assert list(table["trial"]) == [1, 2, 1]
    assert list(table["seconds"]) == [2.5, 3.0, 2.0]


@pytest.mark.parametrize(
    "text",
    [
        GOOD.replace(",", ";"),
        "\ufeff" + GOOD.replace("\n", "\r\n"),
        GOOD + ",,,\n\n , , ,\n",
        GOOD.replace("cube,sphere", "  cube , sphere "),
        GOOD.replace("none", "None"),
    ],
    ids=["semicolons", "byte order mark and Windows", "empty lines", "spaces", "None"],
)
def test_what_spreadsheets_make_of_a_table_is_read_as_it_was(tmp_path: Path, text: str) -> None:
    expected = read_trials(written(tmp_path, GOOD))
    pd.testing.assert_frame_equal(read_trials(written(tmp_path, text, "other.csv")), expected)


def test_events_as_bids_has_them(tmp_path: Path) -> None:
    text = "onset\tduration\ttrial_type\tresponse\tresponse_time\n0.5\t2\tcube\tcube\tn/a\n3\t2\tcube\tsphere\t1.2\n"
    table = read_trials(written(tmp_path, text, "sub-07_task-haptic_events.tsv"))
    assert set(table["subject"]) == {"07"}
    assert list(table["seconds"]) == [2.0, 2.0]
    np.testing.assert_array_equal(table["response_time"], [np.nan, 1.2])
    assert list(table)[-1] == "onset"


def test_columns_units_and_names_of_ones_own(tmp_path: Path) -> None:
    text = "vp,stim,answer,ms,sure,response\nA,Würfel,ja,2500,70,left\nB,egg,no,100,,right\n"
    toml = """[columns]\nsubject = "vp"\nobject = "stim"\nresponse = "answer"\nseconds = "ms"\nconfidence = "sure"
[units]\nseconds = "ms"\nconfidence = "percent"\n[names]\n"Würfel" = "cube"\negg = "ellipsoid(1.10)"\nja = "yes"\n"""
    by_file = read_trial_columns(written(tmp_path, toml, "map.toml"))
    columns = ("subject=vp", "object=stim", "response=answer", "seconds=ms", "confidence=sure")
    by_flags = typed(
        None, columns, ("seconds=ms", "confidence=percent"), ("Würfel=cube", "egg=ellipsoid(1.10)", "ja=yes")
    )
    table = read_trials(written(tmp_path, text), by_file)
    pd.testing.assert_frame_equal(table, read_trials(written(tmp_path, text), by_flags))
    assert list(table["object"]) == ["cube", "ellipsoid(1.1)"]
    assert list(table["response"]) == ["yes", "no"]
    np.testing.assert_allclose(table["seconds"], [2.5, 0.1])
    np.testing.assert_array_equal(table["confidence"], [0.7, np.nan])
    assert list(table["original_response"]) == ["left", "right"]  # was mapped away, and is kept


def test_every_trial_may_have_taken_as_long(tmp_path: Path) -> None:
    place = written(tmp_path, "subject,object,response\nA,cube,cube\n")
    assert list(read_trials(place, typed(columns=["seconds=5"]))["seconds"]) == [5.0]
    assert list(read_trials(place, typed(columns=["seconds=5", "deadline=6"]))["deadline"]) == [6.0]


@pytest.mark.parametrize("ending", ["csv", "tsv"])
def test_what_is_written_is_read_again(tmp_path: Path, ending: str) -> None:
    text = (
        "subject,object,response,seconds,confidence,response_time,recording,condition,code,age\n"
        'A,cube,none,0.1,0.3,,rec/a.npz,one hand,007,30\n"B ""b""",sphere,yes,1,,0,,,008,\n'
    )
    table = read_trials(written(tmp_path, text))
    assert list(table["code"]) == ["007", "008"]
    assert table["recording"].iloc[0] == str(tmp_path / "rec" / "a.npz")
    (tmp_path / "deeper").mkdir()
    write_trials(table, tmp_path / "deeper" / f"again.{ending}")
    pd.testing.assert_frame_equal(read_trials(tmp_path / "deeper" / f"again.{ending}"), table)


def bad(*rows: str, header: str = HEADER) -> str:
    return "\n".join([header, "A,cube,cube,1" + ",1" * header.count(",", len(HEADER)), *rows, ""])


FAULTS = {
    "an empty file": ("", "it is empty"),
    "a header alone": (f"{HEADER}\n", "no trials below it"),
    "no table": ("hello world\n1\n", "separated by commas (.csv) or tabs"),
    "columns of other names": ("vp,stim\nA,cube\n", "no column subject, object, response, seconds; there are vp, stim"),
    "columns twice": (f"{HEADER},subject\nA,cube,cube,1,B\n", "line 1: columns subject are there twice"),
    "cells too many": (
        bad("A,cube,cube,2,5", "B,cube,cube,2,5"),
        "lines 3, 4: 5 cells in place of 4; was a number written with",
    ),
    "cells too few": (bad("A,cube"), "line 3: 2 cells in place of 4; was it cut short?"),
    "an open quote": (bad('A,"cube,cube,1'), "line 3: unexpected end of data"),
    "no subject": (bad(",cube,cube,1"), "line 3: subject is missing"),
    "no response": (bad("A,cube,n/a,1", "A,cube,,1"), "lines 3, 4: response is missing"),
    "no object of that name": (
        bad("A,cubee,cube,1", "A,sphre,cube,1"),
        "lines 3, 4: unknown object 'cubee' (did you mean 'cube'?)",
    ),
    "no answer of that name": (bad("A,cube,maybe,1"), "line 3: unknown response 'maybe'"),
    "an object out of range": (bad("A,ellipsoid(-1),cube,1"), "line 3: shape 'ellipsoid(-1)'"),
    "a class": (bad("A,os:system,cube,1"), "line 3: "),
    "a decimal comma": (bad('A,cube,cube,"2,5"'), "line 3: seconds has a decimal comma, got '2,5'"),
    "words for a number": (
        bad("A,cube,cube,five", "A,cube,cube,six"),
        "lines 3, 4: seconds must be a number (s), got 'five', 'six'",
    ),
    "no time": (bad("A,cube,cube,0"), "line 3: seconds must be in (0, "),
    "an endless time": (bad("A,cube,cube,inf"), "line 3: seconds must be a number (s), got 'inf'"),
    "a negative response time": (
        bad("A,cube,cube,1,-1", header=f"{HEADER},response_time"),
        "line 3: response_time must be in [0, ",
    ),
    "a confidence of 70": (
        bad("A,cube,cube,1,70", header=f"{HEADER},confidence"),
        "line 3: confidence must be in [0, 1]; of per cent say",
    ),
    "a trial twice": (
        bad("A,cube,cube,1,1", header=f"{HEADER},trial"),
        "lines 2, 3: a subject has a trial of one number",
    ),
    "half a trial": (
        bad("A,cube,cube,1,1.5", header=f"{HEADER},trial"),
        "line 3: trial must be a whole number, got 1.5",
    ),
    "a bell": (bad("A\x07,cube,cube,1"), "line 3: subject must be at most 200 characters that can be printed"),
    "another encoding": (GOOD.replace("A,", "Ä,").encode("latin-1"), "not a text file"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_told_in_one_line_with_file_and_place(tmp_path: Path, fault: str) -> None:
    text, said = FAULTS[fault]
    with pytest.raises(ValueError, match=re.escape(said)) as error:
        read_trials(written(tmp_path, text))
    assert str(error.value).startswith(str(tmp_path / "t.csv"))
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("name", ["missing.csv", "folder.tsv"])
def test_a_file_that_is_not_there_is_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.tsv").mkdir()
    with pytest.raises(FileNotFoundError, match=rf"^.*{name}: there is no such file"):
        read_trials(tmp_path / name)


def test_many_faults_are_counted(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"lines 3, 4, .*, 12, … \(40 in all\): seconds"):
        read_trials(written(tmp_path, bad(*["A,cube,cube,-1"] * 40)))


def test_any_names_may_be_taken_as_they_are(tmp_path: Path) -> None:
    table = read_trials(written(tmp_path, f"{HEADER}\nA,key,door key,1\n"), free_names=True)
    assert list(table.loc[0, ["object", "response"]]) == ["key", "door key"]


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: typed(columns=["subject"]), "--column must be like seconds=duration, got 'subject'"),
        (lambda: typed(columns=["subject=a", "subject=b"]), "--column subject is given twice"),
        (lambda: typed(columns=["subjekt=a"]), "unknown column 'subjekt' (did you mean 'subject'?)"),
        (lambda: typed(columns=["seconds=-5"]), "column seconds, if it is a number, must be"),
        (lambda: typed(units=["seconds=hours"]), "unknown unit of seconds 'hours'"),
        (lambda: typed(units=["trial=s"]), "unknown column with a unit 'trial'"),
        (lambda: TrialColumns(columns={"subject": 3}), "column subject must be a name of a column, got 3"),
        (lambda: TrialColumns(names={"a": 3}), "name 'a' must mean a shape, got 3"),
        (lambda: TrialColumns(names=3), "names must be names and what they mean, got 3"),  # type: ignore[arg-type]
    ],
)
def test_what_columns_cannot_mean(call, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        call()


def test_a_table_made_in_python_is_checked_alike() -> None:
    good = pd.DataFrame(
        {"subject": ["A", "A"], "object": "cube", "response": "cube", "seconds": [1, 2], "x": [True, False]}
    )
    assert list(check_trials(good.set_index(pd.Index([5, 5])))["trial"]) == [1, 2]
    assert "trial" not in good
    for column, value, said in (("seconds", -1.0, "table, rows 0, 1: seconds"), ("object", "cubee", "unknown object")):
        with pytest.raises(ValueError, match=said):
            check_trials(good.assign(**{column: value}))
    with pytest.raises(ValueError, match=r"a pandas\.DataFrame"):
        check_trials([1])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no column response"):
        check_trials(good.drop(columns="response"))


def test_nothing_is_written_of_a_table_that_is_none(tmp_path: Path) -> None:
    good = pd.DataFrame({"subject": ["A"], "object": "cube", "response": "cube", "seconds": 1.0})
    with pytest.raises(ValueError, match=r"unknown ending of a table '\.xlsx'"):
        write_trials(good, tmp_path / "t.xlsx")
    with pytest.raises(ValueError, match="seconds"):
        write_trials(good.assign(seconds=0.0), tmp_path / "t.csv")
    assert not list(tmp_path.iterdir())
