"""What is said of people beside observers: in the numbers of a table, and in what is not made up."""

from __future__ import annotations

import importlib.util
import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from haptic_lab.people import report
from haptic_lab.people.analysis import Analysis, analyse
from haptic_lab.people.courses import Courses
from haptic_lab.people.curves import levels_of
from haptic_lab.people.detection import share_correct
from haptic_lab.people.matching import match
from haptic_lab.people.observed import Cell, of_courses, read_observers
from haptic_lab.people.scoring import Design, design_of
from haptic_lab.people.summaries import PEOPLE, binned
from haptic_lab.people.trials import check_trials
from tests.haptic_lab.people.beside import LEVELS, NAMES, ellipsoid, judges, people, sweep

LABELS = ("haptic SLAM", "raw angles (floor)")
needs_psignifit = pytest.mark.skipif(importlib.util.find_spec("psignifit") is None, reason="needs the extra people")


def line(table: pd.DataFrame, **which: object) -> pd.Series:
    for name, value in which.items():
        table = table[table[name].isna()] if value is None else table[table[name] == value]
    (found,) = table.to_dict("records")
    return pd.Series(found)


@pytest.fixture(scope="module")
def beside(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    folder = sweep(tmp_path_factory.mktemp("made") / "sweep", {"haptic_slam": 0.97, "floor": 0.4})
    table = check_trials(people())
    return analyse(table, design_of(table), read_observers(folder))


def test_accuracy_is_that_of_the_table(beside: Analysis) -> None:
    table = people()
    right = table["object"] == table["response"]
    for seconds in (2.0, 5.0):
        mine = line(beside.tables["accuracy"], who=PEOPLE, seconds=seconds)
        assert mine["share"] == pytest.approx(right[table["seconds"] == seconds].mean())
        assert mine["low"] < mine["share"] < mine["high"]
    assert line(beside.tables["accuracy"], who="S1", seconds=None)["trials"] == 40
    assert line(beside.tables["accuracy"], who="haptic SLAM", seconds=None)["share"] == pytest.approx(0.9)


def test_confusions_add_up_in_each_row(beside: Analysis) -> None:
    for _, mine in beside.tables["confusion"].groupby(["who", "object"]):
        assert mine["share"].sum() == pytest.approx(1.0)
    wrong = line(beside.tables["confusion"], who="haptic SLAM", object="cube", response="sphere")
    assert wrong["share"] == pytest.approx(0.1)


def test_d_prime_and_efficiency_are_those_of_the_shares(beside: Analysis) -> None:
    ours = line(beside.tables["sensitivity"], who="S0", seconds=5.0)
    counted = line(beside.tables["accuracy"], who="S0", seconds=5.0)
    corrected = (counted["share"] * counted["trials"] + 0.25) / (counted["trials"] + 1)
    assert float(share_correct(ours["d_prime"], 4)) == pytest.approx(corrected)
    theirs = line(beside.tables["sensitivity"], who="haptic SLAM", seconds=5.0)
    found = line(beside.tables["efficiency"], who="S0", observer="haptic SLAM", seconds=5.0)
    assert found["efficiency"] == pytest.approx((ours["d_prime"] / theirs["d_prime"]) ** 2)


def test_the_observer_that_says_more_of_people_comes_first(beside: Analysis) -> None:
    nats = {name: line(beside.tables["agreement"], who=PEOPLE, observer=name)["nats"] for name in LABELS}
    assert nats["raw angles (floor)"] > nats["haptic SLAM"]
    assert beside.facts["observers"].startswith("raw angles (floor)")
    assert list(beside.figures) == ["confusion", "accuracy", "sensitivity", "agreement", "times"]


def test_an_observer_without_mistakes_has_no_efficiency_and_says_what_to_do(tmp_path: Path) -> None:
    table = check_trials(people())
    found = analyse(table, design_of(table), read_observers(sweep(tmp_path / "sweep", {"haptic_slam": 1.0})))
    mine = found.tables["efficiency"]
    assert mine["efficiency"].isna().all()
    assert (mine["high"] > 0.0).all()
    (note,) = found.notes
    assert re.search(r"No mistake was made by haptic SLAM in 40 trials.*more noise.*less time", note)


def test_a_subject_without_mistakes_is_told_and_has_a_bound(tmp_path: Path) -> None:
    answers = people()
    answers.loc[answers["subject"] == "S1", "response"] = answers["object"]
    table = check_trials(answers)
    found = analyse(table, design_of(table), read_observers(sweep(tmp_path / "sweep", {"haptic_slam": 0.9})))
    assert any(note.startswith("No mistake was made by S1: the mean d′ over subjects") for note in found.notes)
    assert math.isinf(line(found.tables["efficiency"], who="S1", seconds=5.0)["high"])
    assert math.isfinite(line(found.tables["efficiency"], who="S0", seconds=5.0)["high"])


@pytest.mark.parametrize(
    ("value", "low", "high", "told"),
    [
        (0.5, 0.4, 0.6, "50 % [40, 60]"),
        (2.0, 0.0, 4e5, "200 % [0, > 1000]"),
        (math.nan, 0.0, 0.3, "below 30 %"),
        (math.nan, 1.5, math.inf, "above 150 %"),
        (math.nan, 0.0, math.inf, "–"),
    ],
)
def test_an_efficiency_is_told_as_far_as_it_is_known(value: float, low: float, high: float, told: str) -> None:
    said = {"who": ["people"], "observer": ["haptic SLAM"], "efficiency": [value], "low": [low], "high": [high]}
    printed = report._printed("Efficiency", pd.DataFrame(said), ("efficiency",), percent=True)
    assert list(printed.columns[-1].cells) == [told]


def test_people_alone_are_told_of_too() -> None:
    table = check_trials(people(subjects=1))
    found = analyse(table, design_of(table))
    assert list(found.tables) == ["accuracy", "confusion", "sensitivity"]
    mine = line(found.tables["sensitivity"], who=PEOPLE, seconds=5.0)
    alone = line(found.tables["sensitivity"], who="S0", seconds=5.0)  # one subject says nothing of others
    assert mine[["d_prime_low", "d_prime_high"]].equals(alone[["d_prime_low", "d_prime_high"]])
    assert not found.notes


@needs_psignifit
def test_a_stimulus_that_varies_has_a_psychometric_function() -> None:
    table = check_trials(judges((1.14,), each=40))
    found = analyse(table, design_of(table, absent=[ellipsoid(LEVELS[0])]))
    mine = line(found.tables["psychometric"], who=PEOPLE)
    assert mine["threshold_low"] < 1.14 < mine["threshold_high"]
    assert {"criterion", "d_prime"} <= set(found.tables["sensitivity"])


def test_a_column_may_have_the_levels_and_without_absent_objects_nothing_is_right() -> None:
    table = check_trials(judges((1.14,), each=2))
    levels = {ellipsoid(level): 10 * level for level in LEVELS}
    assert levels_of(table.assign(ratio=table["object"].map(levels)), "ratio") == ("ratio", levels)
    assert levels_of(table)[0] == "ellipsoid z"
    alike = table.assign(response="yes")
    found = analyse(alike, design_of(alike))
    assert list(found.tables) == ["confusion", "psychometric", "levels"]
    assert "--absent" in found.notes[0]
    assert "no level is a threshold" in found.notes[1]


def test_what_people_did_and_observers_did_not_is_told(tmp_path: Path) -> None:
    table = check_trials(people())
    observers = read_observers(sweep(tmp_path / "sweep", {"haptic_slam": 0.9}, times=(5.0,)))
    found = analyse(table, design_of(table), observers)
    assert "did not explore cube for 2 s" in found.notes[0]
    assert "60 of 120 trials are left out" in found.notes[0]
    assert line(found.tables["agreement"], who=PEOPLE)["trials"] == 60
    only = table[table["seconds"] == 2.0]
    with pytest.raises(ValueError, match=r"no observer explored what people did: .*evaluate"):
        analyse(only, design_of(only), observers)
    several = [observers[0]._replace(label=label) for label in ("A", "B", "C")]
    gaps = [note for note in analyse(table, design_of(table), several).notes if "did not explore" in note]
    assert len(gaps) == 1  # all alike: once, with how many there are
    assert gaps[0].startswith("A and 2 more observers did not explore cube for 2 s")


def test_an_observer_that_had_fewer_names_to_choose_from_is_left_out(tmp_path: Path) -> None:
    answers = people()
    odd = answers.assign(object=answers["object"].replace("cone", "torus"), response="cube")
    table = check_trials(odd)
    observers = read_observers(sweep(tmp_path / "sweep", {"haptic_slam": 0.9}))
    with pytest.raises(
        ValueError, match=r"Left out, as they did not know of torus, .*: haptic SLAM\. .*candidates of the table"
    ):
        analyse(table, design_of(table), observers)
    table = check_trials(answers.assign(response=answers["response"].replace("cone", "torus")))
    assert "accuracy" in analyse(table, design_of(table), observers).tables  # torus was no object


def test_courses_say_what_was_believed_by_then() -> None:
    log_posterior = np.log(np.array([[0.5, 0.5], [0.6, 0.4], [0.99, 0.01]]))[None, None, None]
    courses = Courses(
        names=("cube", "sphere"), objects=("cube",), conditions=("",), sigmas=np.array([3.0]),
        seconds=np.array([0.0, 1.0, 2.0]), log_posterior=log_posterior,
    )  # fmt: skip
    (observer,) = of_courses(courses, "mine")
    found = observer.find(Cell("cube", "", "", 1.0))
    assert found is not None
    np.testing.assert_allclose(found.posterior, [[0.6, 0.4]])
    assert found.decided[0] == 2.0
    assert observer.find(Cell("cube", "", "", 5.0)) is None
    assert observer.find(Cell("cone", "", "", 1.0)) is None
    table = check_trials(
        pd.DataFrame({"subject": "A", "object": "cube", "response": ["cube", "no"][:1], "seconds": 2.0})
    )
    matched = match(table, Design("identification", ("sphere", "cube")), observer)
    np.testing.assert_allclose(matched.probabilities, [[0.01, 0.99]])


def test_an_observer_is_weighted_as_often_as_people_explored() -> None:
    always_cube = np.log(np.broadcast_to([0.9, 0.1], (2, 1, 4, 2, 2)))
    courses = Courses(
        names=("cube", "sphere"), objects=("cube", "sphere"), conditions=("", ""), sigmas=np.array([3.0]),
        seconds=np.array([0.0, 1.0]), log_posterior=always_cube,
    )  # fmt: skip
    objects = ["cube", "cube", "cube", "sphere"]
    table = check_trials(pd.DataFrame({"subject": "A", "object": objects, "response": objects, "seconds": 1.0}))
    found = analyse(table, design_of(table), of_courses(courses, "mine"))
    theirs = line(found.tables["accuracy"], who="mine")
    assert theirs["share"] == pytest.approx(0.75)
    assert theirs["trials"] == 8
    d_prime = line(found.tables["sensitivity"], who="mine")["d_prime"]
    assert float(share_correct(d_prime, 2)) == pytest.approx(6.5 / 9)  # 6 of 8 with the correction
    assert line(found.tables["agreement"], who="A", observer="mine")["kappa"] == pytest.approx(0.0)


@pytest.mark.parametrize("alike", [True, False])
@pytest.mark.parametrize("absent", [[], ["sphere"]])
def test_an_exploration_seen_at_several_times_is_no_more_trials(alike: bool, absent: list[str]) -> None:
    """An observer that never changes its mind knows no more of all times than of one; else each time may tell more."""
    rng, repeats, times = np.random.default_rng(900_023), 100, 4
    right = rng.random((2, repeats, 1 if alike else times)) < 0.8
    log_posterior = np.log(np.where(right[..., None] ^ [[[[False, True]]], [[[True, False]]]], 0.9, 0.1))
    courses = Courses(
        names=("cube", "sphere"), objects=("cube", "sphere"), conditions=("", ""), sigmas=np.array([3.0]),
        seconds=np.arange(1.0, times + 1.0),
        log_posterior=np.broadcast_to(log_posterior, (2, repeats, times, 2))[:, None],
    )  # fmt: skip
    objects = [name for name in ("cube", "sphere") for _ in range(times)]
    answers = [("no" if name in absent else "yes") if absent else name for name in objects]
    told = {"subject": "A", "object": objects, "response": answers, "seconds": [*courses.seconds] * 2}
    table = check_trials(pd.DataFrame(told))
    found = analyse(table, design_of(table, absent=absent), of_courses(courses, "mine")).tables
    for name in ("accuracy", "sensitivity"):
        every, one = (line(found[name], who="mine", seconds=time) for time in (None, 2.0))
        assert one["trials"] == 2 * repeats
        if alike:
            pd.testing.assert_series_equal(every.drop("seconds"), one.drop("seconds"), rtol=0.02)
        else:
            assert every["trials"] > 0.7 * times * one["trials"]


@pytest.mark.parametrize(("sizes", "said"), [((0.046, 0.048, 0.052), True), ((0.046, 0.047, 0.048), False)])
def test_a_standard_between_the_levels_has_no_threshold(sizes: tuple[float, ...], said: bool) -> None:
    objects = [f"cube(size={size:g})" for size in sizes] * 4
    answers = ["yes", "no", "yes"] * 3 + ["no", "yes", "yes"]
    table = check_trials(pd.DataFrame({"subject": "A", "object": objects, "response": answers, "seconds": 1.0}))
    design = design_of(table, standard=table["object"][0].replace("46", "5"))
    if said:
        with pytest.raises(ValueError, match=r"below that of the standard, 0\.05, in some objects and above it"):
            levels_of(table, None, design.standard)
        assert any("report the two apart" in note for note in analyse(table, design).notes)
    else:
        assert [*levels_of(table, None, design.standard)[1].values()] == list(sizes)


def test_many_times_are_put_together() -> None:
    times = np.random.default_rng(900_022).uniform(1, 9, 50)
    found = binned(pd.DataFrame({"seconds": times}))
    assert len(set(found.values())) == 5
    assert all(abs(to - time) < 4 for time, to in found.items())


@pytest.mark.parametrize(
    ("answers", "objects", "options", "said"),
    [
        (
            ["yes", "cube"],
            ["cube", "cube"],
            {},
            "response is yes or no in some trials and a name in others",
        ),
        (["cube", "cube"], ["cube", "cube"], {}, "there must be two answers to choose from at least, got cube"),
        (["cube", "sphere"], ["cube", "cube"], {"absent": ["cube"]}, "absent objects are those of yes and no"),
        (
            ["yes", "no"],
            ["cube", "cone"],
            {"absent": ["sphere"]},
            "unknown absent object 'sphere'",
        ),
        (["yes", "no"], ["cube", "cone"], {"absent": ["cube", "cone"]}, "must not be all that there are"),
        (["yes", "no"], ["cube", "cone"], {"kind": "identification"}, "must be names of objects, got yes, no"),
        (["cube", "cone"], ["cube", "cone"], {"kind": "2afc"}, "must be yes or no, got cube, cone"),
        (["cube", "cone"], ["cube", "cone"], {"candidates": ["cube", "sphere"]}, "got responses cone"),
        (["cube", "cone"], ["cube", "cone"], {"kind": "3afc"}, "unknown design '3afc'"),
    ],
)
def test_what_was_asked_must_fit_the_answers(answers, objects, options, said: str) -> None:
    table = check_trials(pd.DataFrame({"subject": "A", "object": objects, "response": answers, "seconds": 1.0}))
    with pytest.raises(ValueError, match=re.escape(said)):
        design_of(table, **options)


def test_of_an_object_that_is_no_candidate_none_is_right() -> None:
    answers = ["cube", "none", "cube", "none"]
    table = check_trials(pd.DataFrame({"subject": "A", "object": [*NAMES], "response": answers, "seconds": 1.0}))
    design = design_of(table, candidates=["cube", "sphere"])
    assert design.answers == ("cube", "sphere", "none")
    assert list(design.right(table["object"])) == ["cube", "sphere", "none", "none"]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "observers must be a folder of haptic-slam evaluate, with trials.csv in it"),
        ("", "not the table of a sweep"),
        ("a,b\n1,2\n", "there is no observer, shape, seconds, time_to_decision in it"),
        ("observer,shape,seconds,time_to_decision\na,cube,1,\n", "there is no p_NAME in it"),
        ("observer,shape,seconds,time_to_decision,p_cube\n", "there are no trials in it yet"),
        ("observer,shape,seconds,time_to_decision,p_cube\na,cube,1,,x\n", "not all are numbers in p_cube"),
        ("observer,shape,seconds,time_to_decision,p_cube\na,cube,1,,1.5\n", "not all are probabilities in p_cube"),
        ("observer,shape,seconds,time_to_decision,p_cube\na,cube,0,,0.5\n", "not all seconds are above 0"),
    ],
)
def test_a_folder_that_is_no_sweep_is_refused(tmp_path: Path, content: str | None, said: str) -> None:
    if content is not None:
        (tmp_path / "trials.csv").write_text(content)
    with pytest.raises(ValueError, match=re.escape(said)):
        read_observers(tmp_path)
