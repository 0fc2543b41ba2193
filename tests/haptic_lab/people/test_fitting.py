"""Simulated people, and what is found of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from haptic_lab.people import answers, likelihood, repeats
from haptic_lab.people.comparing import Comparison, compare, parted, recoveries, recovery_table
from haptic_lab.people.courses import Courses
from haptic_lab.people.decisions import Decision
from haptic_lab.people.designing import Design, design, numbers
from haptic_lab.people.fitting import Prepared, fit
from haptic_lab.people.models import Grid, Model
from haptic_lab.people.simulated import Subject, halves, simulate, subject_of
from haptic_lab.people.trials import check_trials
from tests.haptic_lab.people.made_courses import made

SECONDS = (0.5, 1.0, 2.0, 6.0)


@pytest.fixture(scope="module")
def courses() -> Courses:
    return made(900_201, 40)


def answered(courses: Courses, trials: int = 200, **values: float):
    return simulate(courses, subject_of(values), trials, SECONDS, np.random.default_rng(900_202))


def test_a_simulated_table_is_one_of_trials(courses):
    table = answered(courses, sigma_deg=3.0, memory_seconds=2.0, lapse=0.1)
    assert len(check_trials(table)) == 200
    assert (table.groupby(["object", "seconds"]).size().between(12, 13)).all()
    assert set(table["true_lapse"]) == {0.1}
    again = answered(courses, sigma_deg=3.0, memory_seconds=2.0, lapse=0.1)
    assert again.equals(table)


def test_who_stops_by_itself_is_done_earlier_and_tells_when(courses):
    table = answered(courses, sigma_deg=2.0, stop_at=0.9)
    assert (table["response_time"] == table["seconds"]).all()
    early = table["seconds"] < 6.0
    assert (table.loc[early & ~table["seconds"].isin(SECONDS), "confidence"] >= 0.9 - 1e-4).all()
    dear, cheap = (answered(courses, sigma_deg=2.0, price=price)["seconds"].mean() for price in (0.3, 0.01))
    assert dear < cheap


def test_simulated_answers_are_as_often_as_decisions_say(courses):
    decision = Decision(memory_seconds=1.0, decision_noise=1.0, lapse=0.1)
    table = simulate(courses, Subject(4.0, decision), 4000, [2.0], np.random.default_rng(900_203))
    for cell, name in enumerate(courses.objects):
        wanted = decision.response_probabilities(courses, cell, 4.0, 2.0)
        found = [(table.loc[table["object"] == name, "response"] == each).mean() for each in courses.names]
        np.testing.assert_allclose(found, wanted, atol=0.06)


@pytest.mark.parametrize("values", [{}, {"stop_at": 0.75}, {"price": 0.01}])
def test_a_sigma_between_two_of_the_courses_is_each_in_its_share(values: dict[str, float]):
    """As decisions have it: not a belief between the two, which would be right in all trials here."""
    believed = np.log(np.array([[[0.9, 0.1]], [[0.2, 0.8]]]))[:, None].repeat(2, axis=2)  # (S, R, T, C)
    both = np.stack([believed, believed[..., ::-1]])
    two = Courses(
        names=("cube", "sphere"), objects=("cube", "sphere"), conditions=("", ""), sigmas=np.array([1.0, 4.0]),
        seconds=np.array([1.0, 2.0]), log_posterior=both,
    )  # fmt: skip
    subject = subject_of({"sigma_deg": 2.0, **values})
    table = simulate(two, subject, 400, [2.0], np.random.default_rng(900_218))
    wanted = subject.decision.response_probabilities(two, 0, 2.0, 2.0)[0]
    assert wanted == pytest.approx(0.5)
    assert (table["object"] == table["response"]).mean() == pytest.approx(wanted, abs=0.08)


def test_each_repeat_is_dealt_once_before_any_is_dealt_again(courses):
    """Of as many trials as repeats the answers of the ideal are those of the repeats themselves."""
    table = simulate(courses, Subject(4.0, Decision()), 4 * 40, [2.0], np.random.default_rng(900_204))
    for cell, name in enumerate(courses.objects):
        wanted = Decision().response_probabilities(courses, cell, 4.0, 2.0)
        found = [(table.loc[table["object"] == name, "response"] == each).mean() for each in courses.names]
        np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_halves_have_all_repeats_between_them(courses):
    first, second = halves(courses, np.random.default_rng(900_205))
    both = np.concatenate((first.log_posterior, second.log_posterior), axis=2)
    assert first.repeats == second.repeats == 20
    np.testing.assert_array_equal(
        np.sort(both[:, 0, :, 3, 0], axis=1), np.sort(courses.log_posterior[:, 0, :, 3, 0], axis=1)
    )


def test_borrowed_repeats_estimate_what_many_repeats_say():
    """Other objects' explorations, weighed by Bayes' rule, come nearer to the truth than an object's own alone."""
    few, many = made(900_206, 24), made(900_207, 800)
    cells, seconds = np.arange(4), np.full(4, 2.0)
    wanted = np.array([Decision().response_probabilities(many, cell, 8.0, 2.0) for cell in cells])
    own = np.array([Decision().response_probabilities(few, cell, 8.0, 2.0) for cell in cells])
    model = Model.named("ideal", few, {"sigma_deg": (8.0, 8.0)})
    every = answers.every_answer(few, [2.0])
    found = likelihood.predicted(model, every, repeats.draws(few, 0, 0)).sure[0, 0, 0, 0, 0, :, 3].reshape(4, 4)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, atol=1e-5)
    assert found.min() > 0.0
    assert np.abs(found - wanted).mean() < np.abs(own - wanted).mean()
    (part,) = repeats.weighed(few, cells, seconds, repeats.draws(few, 3, 0))
    np.testing.assert_allclose(part.weights.sum(axis=-1), 1.0, atol=1e-5)


def test_a_likelihood_is_the_product_over_trials(courses):
    table = answered(courses, 30, sigma_deg=3.0)
    model = Model.named("limits", courses, {"lapse": (0.1, 0.1), "sigma_deg": (4.0, 4.0), "memory_seconds": (2.0, 2.0)})
    found = fit(model, table, draws=0)
    expected = dict(zip(zip(found.answers.question, found.answers.response, strict=True), found.expected, strict=True))
    assert found.log_likelihood == pytest.approx(
        sum(math.log(expected[key]) * count for key, count in zip(expected, found.answers.count, strict=True)), rel=1e-4
    )
    assert found.log_evidence == pytest.approx(found.log_likelihood, rel=1e-5)
    assert found.cross_validated.sum() == pytest.approx(found.log_likelihood, rel=1e-4)


def test_leave_one_out_is_what_comes_of_leaving_one_out(courses):
    table = answered(courses, 60, sigma_deg=3.0, lapse=0.1)
    model = Model.named("lapse", courses)
    whole = fit(model, table, draws=3)
    for left in (0, 17, 42):
        others = fit(model, table.drop(index=left), draws=3)
        told = whole.log_evidence - others.log_evidence  # p(one | others) = p(all) / p(others)
        assert whole.cross_validated[left] == pytest.approx(told, abs=1e-3)


def test_parameters_are_found_where_there_is_enough_to_tell(courses):
    first, second = made(900_208, 300), made(900_209, 200)
    truth = {"sigma_deg": 2.5, "memory_seconds": 1.0, "lapse": 0.12}
    table = simulate(first, subject_of(truth), 1200, SECONDS, np.random.default_rng(900_210))
    found = fit(Model.named("limits", second), table, draws=0)
    for name, value in truth.items():
        estimate, low, high = found.interval(name)
        assert low < estimate < high
        assert low < value < high, (name, low, value, high)
        assert high - low < 2.2 * value


def test_draws_of_repeats_widen_what_few_repeats_tell():
    few = made(900_211, 12)
    table = answered(made(900_212, 100), 300, sigma_deg=3.0)
    model = Model.named("ideal", few)
    narrow, wide = (fit(model, table, draws=draws).interval("sigma_deg") for draws in (0, 64))
    assert wide[2] / wide[1] > narrow[2] / narrow[1]


def test_a_prepared_model_fits_as_a_fresh_one(courses):
    table = answered(courses, 90, sigma_deg=3.0, lapse=0.1)
    model = Model.named("lapse", courses)
    one, other = fit(model, table, draws=4, seed=1), Prepared(model, SECONDS, draws=4, seed=1).fit(table)
    assert one.log_evidence == pytest.approx(other.log_evidence, abs=1e-3)
    np.testing.assert_allclose(one.interval("lapse"), other.interval("lapse"), rtol=1e-3)
    np.testing.assert_allclose(one.cross_validated, other.cross_validated, atol=1e-4)


def test_conditions_are_cells_of_their_own():
    two = made(900_213, 20, conditions=2)
    table = simulate(two, subject_of({"sigma_deg": 3.0}), 80, [1.0, 3.0], np.random.default_rng(900_214))
    assert set(table["condition"]) == {"condition 0", "condition 1"}
    found = fit(Model.named("ideal", two), table, draws=2)
    assert len(found.answers.cells) == 16
    with pytest.raises(ValueError, match=r"trial 1 of subject .* no course"):
        fit(Model.named("ideal", two), table.drop(columns="condition"))


def test_grids_split_their_probability_where_it_lies():
    grid = Grid(1.0, 16.0, 4, True)
    np.testing.assert_allclose(grid.quantiles(np.ones(4), (0.0, 0.25, 0.5, 1.0)), [1.0, 2.0, 4.0, 16.0])
    np.testing.assert_allclose(Grid(0.0, 1.0, 4, False).quantiles(np.array([0, 1, 1, 0.0]), (0.5,)), [0.5])
    assert Grid(2.0, 2.0, 1, True).drawn(np.random.default_rng(0)) == 2.0


def test_the_right_one_of_two_very_different_models_is_found(courses):
    big = made(900_215, 160)
    felt = {"sigma_deg": (1.0, 2.5)}
    models = [Model.named("ideal", big, felt), Model.named("lapse", big, {**felt, "lapse": (0.4, 0.6)})]
    found = list(recoveries(models, 200, SECONDS, 3, seed=900_216))
    table = recovery_table(found, ["ideal", "lapse"])
    right = table[table["true"] == table["best"]]
    assert list(right["share"]) == [1.0, 1.0]
    assert table["subjects"].sum() == 6
    told = compare(models, answered(big, sigma_deg=2.0, lapse=0.5), draws=0)
    assert told.best == "lapse"
    assert list(told.table()["model"]) == ["lapse", "ideal"]
    assert told.table()["difference_high"].iloc[1] < 0.0


def test_halves_of_courses_alike_are_alike(courses):
    other = Courses(**{**vars(courses), "log_posterior": courses.log_posterior.copy()})
    models = [Model("one", courses, ("sigma_deg",)), Model("other", other, ("sigma_deg",))]
    first, second = parted(models, SECONDS, np.random.default_rng(0))
    np.testing.assert_array_equal(first[0].courses.log_posterior, first[1].courses.log_posterior)
    assert {each.model.courses.repeats for each in second} == {20}


def test_a_design_needs_fewer_trials_for_more_different_models():
    big = made(900_217, 120)
    felt = {"sigma_deg": (1.0, 2.5)}
    far = [Model.named("ideal", big, felt), Model.named("lapse", big, {**felt, "lapse": (0.6, 0.8)})]
    for result in design(far, 100, SECONDS, rounds=4, seed=1):
        assert isinstance(result, Design)
    trials, low, high = result.needed(0.8)
    assert 10 <= low <= trials <= min(high, 60)
    assert numbers(100)[-1] == 100
    result.found = [(name, {key: key >= 50 for key in told}) for name, told in result.found]
    assert 32 < result.needed(0.8)[0] <= 51
    result.found = [(name, dict.fromkeys(told, False)) for name, told in result.found]
    assert result.needed(0.8)[0] == math.inf


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c: Model.named("idle", c), "choose from|ideal"),
        (lambda c: Model.named("ideal", c, {"sigma_deg": (0.5, 2.0)}), "sigma_deg"),
        (lambda c: Model.named("lapse", c, {"lapse": (0.5, 0.2)}), "least value first"),
        (lambda c: compare([Model.named("ideal", c)], answered(c, sigma_deg=2.0)), "2 at least"),
        (lambda c: compare([Model.named("ideal", c)] * 2, answered(c, sigma_deg=2.0)), "names of their own"),
        (lambda c: answered(c, sigma_deg=50.0), "got 50"),
        (lambda c: fit(Model.named("ideal", c), answered(c, sigma_deg=2.0).assign(response="egg")), "trial 1 .*'egg'"),
        (lambda c: fit(Model.named("ideal", c), answered(c, sigma_deg=2.0).assign(seconds=9.0)), "got 9"),
        (lambda c: halves(made(1, 1), np.random.default_rng(0)), "2 repeats"),
        (
            lambda c: next(design([Model.named(each, c) for each in ("ideal", "noise", "lapse")], 50, SECONDS)),
            "two models",
        ),
    ],
)
def test_what_cannot_be_is_refused(courses, call, words):
    with pytest.raises(ValueError, match=words):
        call(courses)


def test_a_comparison_of_one_trial_has_no_interval(courses):
    models = [Model.named(name, courses) for name in ("ideal", "lapse")]
    table = compare(models, answered(courses, 1, sigma_deg=2.0), draws=0).table()
    assert table["difference_low"].isna().all()
    assert isinstance(Comparison({}).fits, dict)
