"""Choices of two intervals: courses of them, and observers that are asked as people were."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from haptic_lab.commands import compare, fit
from haptic_lab.people.analysis import analyse
from haptic_lab.people.courses import Courses
from haptic_lab.people.detection import share_correct
from haptic_lab.people.intervals import difference, in_two_intervals, two_intervals
from haptic_lab.people.observed import of_courses
from haptic_lab.people.scoring import design_of
from haptic_lab.people.simulated import simulate, subject_of
from haptic_lab.people.studies import discrimination
from tests.haptic_lab.people.made_courses import made

STANDARD, SECONDS = "cube", (1.0, 3.0)


@pytest.fixture(scope="module")
def courses() -> Courses:
    return made(900_401, 60)


def choices(courses: Courses, trials: int = 240, **values: float) -> pd.DataFrame:
    """Who chooses between two intervals, as a table has it: the object is the comparison."""
    told = simulate(
        two_intervals(courses, STANDARD), subject_of(values), trials, SECONDS, np.random.default_rng(900_402)
    )
    right = (told["object"] == told["response"]).map({True: "yes", False: "no"})
    return told.assign(object=told["condition"], response=right).drop(columns="condition")


def test_two_intervals_are_right_as_often_as_the_ideal_is(courses: Courses) -> None:
    """As `study` counts them: of all that can be put together."""
    two = two_intervals(courses, STANDARD)
    assert two.names == ("yes", "no")
    for name in ("sphere", "pyramid"):
        index, of_standard, sigma = courses.names.index(name), courses.names.index(STANDARD), 3
        felt, others = (
            courses.log_posterior[cell, sigma, :, -1, index] - courses.log_posterior[cell, sigma, :, -1, of_standard]
            for cell in (courses.cell(name), courses.cell(STANDARD))
        )
        correct, trials = discrimination.right(felt, others, 2)
        mine = two.log_posterior[two.cell("yes", name), sigma, :, -1]
        assert (mine[:, 0] > mine[:, 1]).mean() == pytest.approx(correct / trials, abs=0.12)
        mirrored = two.log_posterior[two.cell("no", name), sigma, :, -1]
        np.testing.assert_array_equal(mine, mirrored[:, ::-1])


def test_the_two_intervals_are_of_different_repeats() -> None:
    rng = np.random.default_rng(900_403)
    felt, others = rng.normal(2.0, 1.0, (4000, 1)), rng.normal(0.0, 1.0, (4000, 1))
    assert (difference(felt, others) > 0.0).mean() == pytest.approx(float(share_correct(2.0, 2)), abs=0.02)
    same = rng.normal(size=(4000, 1))  # what is common to a seed must not cancel
    assert difference(same, same).std() == pytest.approx(np.sqrt(2.0), rel=0.05)


def test_what_limits_a_subject_is_found_from_its_choices(
    courses: Courses, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    courses.save("courses.npz")
    choices(made(900_404, 100), 400, sigma_deg=4.0, lapse=0.2).to_csv("two.csv", index=False)
    flags = ["two.csv", "--courses", "courses.npz", "--standard", "cube", "--draws", "0"]
    assert fit.main([*flags, "--model", "lapse"]) == 0
    found = pd.read_csv("out/fit/fit.csv").set_index("parameter")
    for name, truth in (("sigma_deg", 4.0), ("lapse", 0.2)):
        assert found.loc[name, "low"] < truth < found.loc[name, "high"]
    predicted = pd.read_csv("out/fit/predicted.csv")
    assert predicted["trials"].sum() == 400
    assert set(predicted["condition"]) == {"sphere", "pyramid", "cylinder"}
    assert compare.main([*flags, "--models", "ideal", "lapse", "other=courses.npz"]) == 0
    best = pd.read_csv("out/compare/compare.csv").iloc[0]
    assert best["model"] == "lapse"
    with pytest.raises(SystemExit):
        fit.main(flags[:3])
    assert "as in --standard" in capsys.readouterr().err


def test_observers_are_asked_as_people_were(courses: Courses) -> None:
    table = choices(courses, sigma_deg=4.0)
    observers = of_courses(courses, "ideal")
    without = analyse(table, design_of(table, "2afc"), observers)
    assert any("--standard" in note for note in without.notes)
    assert "efficiency" not in without.tables
    assert design_of(table, standard=STANDARD) == design_of(table, "2afc", standard=STANDARD)
    found = analyse(table, design_of(table, standard=STANDARD), observers)
    efficiency = found.tables["efficiency"].query("who == 'people' and seconds.isna()").set_index("observer")
    line = efficiency.loc["ideal, σ = 4°"]
    assert line["low"] < 1.0 < line["high"]
    assert found.tables["agreement"]["nats"].notna().all()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c: two_intervals(c, "torus"), "unknown standard 'torus'"),
        (lambda c: two_intervals(made(1, 1), "cube"), "2 repeats at least"),
        (lambda c: in_two_intervals(choices(c, 5, sigma_deg=2.0), "sphere"), "got the standard, sphere"),
        (lambda c: in_two_intervals(choices(c, 5, sigma_deg=2.0).assign(response="cube"), "cube"), "got cube"),
        (lambda c: design_of(choices(c, 5, sigma_deg=2.0), "yes-no", standard="cube"), "that of two intervals"),
    ],
)
def test_what_is_no_choice_of_two_intervals_is_refused(courses: Courses, call, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        call(courses)
