"""Who answers when it likes: what is found of its rule, from the answers and their times."""

from __future__ import annotations

import math
import re

import numpy as np
import pandas as pd
import pytest
from scipy.special import gammaln
from scipy.stats import dirichlet_multinomial

from haptic_lab.people import answers, stopping
from haptic_lab.people.comparing import check_models
from haptic_lab.people.courses import Courses
from haptic_lab.people.decisions import Decision
from haptic_lab.people.fitting import OF_REPEATS, Prepared, fit
from haptic_lab.people.models import Model
from haptic_lab.people.simulated import simulate, subject_of
from haptic_lab.people.trials import check_trials
from tests.haptic_lab.people.made_courses import made

RULES = {"stop_at": {"sigma_deg": 3.0, "stop_at": 0.8}, "price": {"sigma_deg": 3.0, "price": 0.05}}


@pytest.fixture(scope="module")
def courses() -> Courses:
    return made(900_301, 120)


def answered(rule: str, trials: int = 300, seconds: tuple[float, ...] = (6.0,), **more: float) -> pd.DataFrame:
    return simulate(made(900_302, 200), subject_of(RULES[rule] | more), trials, seconds, np.random.default_rng(900_303))


def test_a_rule_is_found_from_answers_and_their_times(courses: Courses) -> None:
    mine = fit(Model.named("stop_at", courses), answered("stop_at", lapse=0.05))
    for name, truth in (RULES["stop_at"] | {"lapse": 0.05}).items():
        _, low, high = mine.interval(name)
        assert low < truth < high
        grid = mine.model.grids[name]
        assert high / low < 0.9 * grid.high / max(grid.low, 1e-3)  # which says more than the range does


@pytest.mark.parametrize("rule", [{"stop_at": 0.8}, {"price": 0.05}])
@pytest.mark.parametrize("lapse", [0.1, 1.0])  # a guess comes when another answer would have
def test_probabilities_of_answers_and_times_are_those_of_decisions(
    courses: Courses, rule: dict[str, float], lapse: float
) -> None:
    held = {"sigma_deg": 4.0, "lapse": lapse, **rule}
    model = Model("one", courses, (), {name: (value, value) for name, value in held.items()})
    prepared = Prepared(model, [3.0, 6.0])
    every, count = prepared.answers, len(courses.names)
    found = prepared.fit(answered("stop_at", 4, (3.0, 6.0)))
    shares = found.expected.reshape(-1, stopping.BINS, count)
    np.testing.assert_allclose(shares.sum(axis=(1, 2)), 1.0, atol=1e-5)
    for question, (cell, until) in enumerate(zip(every.cells, every.seconds, strict=True)):
        seconds, joint = Decision(**rule, lapse=lapse).answers(courses, int(cell), 4.0, float(until))
        bins = stopping.bin_of(seconds, until, 6.0)
        wanted = np.array([joint[bins == each].sum(axis=0) for each in range(stopping.BINS)])
        assert np.abs(shares[question] - wanted).sum() < 0.3  # of which others' explorations take some noise
        assert shares[question].min() > 0.0


def test_what_few_repeats_tell_is_averaged_over_all_shares_behind_them(courses: Courses) -> None:
    held = {"sigma_deg": (4.0, 4.0), "stop_at": (0.8, 0.8), "lapse": (0.1, 0.1)}
    prepared = Prepared(Model("one", courses, (), held), [6.0])
    found = prepared.fit(answered("stop_at", 120))
    shape = len(found.answers.cells), -1
    alpha = OF_REPEATS * courses.repeats * found.expected.reshape(shape)
    counts = found.answers.count.reshape(shape).astype(int)
    wanted = 0.0
    for each, count in zip(alpha, counts, strict=True):
        orders = gammaln(count.sum() + 1.0) - gammaln(count + 1.0).sum()  # of the same answers
        wanted += dirichlet_multinomial.logpmf(count, each, count.sum()) - orders
    assert found.log_likelihood == pytest.approx(wanted, rel=1e-3)


def test_leave_one_out_is_what_comes_of_leaving_one_out(courses: Courses) -> None:
    table = answered("stop_at", 50)  # held, so that it is quick
    model = Model.named("stop_at", courses, {"lapse": (0.05, 0.05), "sigma_deg": (2.0, 4.0)})
    whole = fit(model, table)
    for left in (0, 21, 40):
        told = whole.log_evidence - fit(model, table.drop(index=left)).log_evidence
        assert whole.cross_validated[left] == pytest.approx(told, abs=1e-3)


def test_bins_part_what_was_asked_for_from_what_came_before() -> None:
    assert stopping.bin_of([0.01, 5.9, 6.0], 6.0, 6.0).tolist() == [0, stopping.BINS - 2, stopping.BINS - 1]
    assert (np.diff(stopping.bin_of(np.linspace(0.0, 6.0, 50), 6.0, 6.0)) >= 0).all()


def test_a_table_says_when_an_answer_was_asked_for(courses: Courses) -> None:
    table = answered("stop_at", 60, (2.0, 6.0))
    assert set(check_trials(table)["deadline"]) == {2.0, 6.0}
    assert (table["seconds"] <= table["deadline"]).all()
    told = answers.answers_of(table, courses, timed=True)
    assert set(told.seconds) == {2.0, 6.0}
    free = answers.answers_of(table.drop(columns="deadline"), courses, timed=True)  # until the courses end
    assert set(free.seconds) == {6.0}
    assert free.count.sum() == told.count.sum() == 60
    with pytest.raises(ValueError, match=r"trial 1 of subject .*no later than the deadline, 0\.01 s"):
        answers.answers_of(table.assign(deadline=0.01), courses, timed=True)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c: Model.named("stop_at", c, {"price": (0.1, 0.1)}), "either stop_at or price"),
        (lambda c: Model.named("stop_at", c, {"stop_at": (0.5, 1.5)}), "range of stop_at"),
        (lambda c: Model("paid", c, ("price",), {"price": (0.0, 1.0)}), "range of price must begin above 0"),
        (
            lambda c: check_models([Model.named("ideal", c), Model("paid", c, ("price",))]),
            "when a subject answers (paid) or wait until it is asked (ideal)",
        ),
    ],
)
def test_rules_that_cannot_be_are_refused(courses: Courses, call, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        call(courses)


def test_who_waits_until_it_is_asked_tells_no_times(courses: Courses) -> None:
    assert not Model.named("limits", courses).timed
    assert "stop_at" not in subject_of({"sigma_deg": 2.0, "stop_at": math.inf, "price": 0.0}).truth
    assert subject_of(RULES["price"]).truth["price"] == 0.05
