"""Decisions from courses: against plain loops, and against closed forms where there are some."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import softmax

from haptic_lab.people import evidence, stopping
from haptic_lab.people.courses import Courses
from haptic_lab.people.decisions import Decision, choices
from tests.haptic_lab.people.made_courses import SIGMAS, made


@pytest.fixture(scope="module")
def courses() -> Courses:
    return made(900_101, 30)


def plain(courses: Courses, decision: Decision, cell: int, level: int, seconds: float) -> np.ndarray:
    """Probabilities of answers by a loop over repeats and time, at a time and a sigma that the courses have."""
    total = np.zeros(len(courses.names))
    stop = int(np.flatnonzero(np.isclose(courses.seconds, seconds))[0])
    for course in courses.log_posterior[cell, level]:
        held, before, at = np.zeros(len(total)), np.full(len(total), -math.log(len(total))), 0.0
        for step in range(stop + 1):
            kept = math.exp(-(courses.seconds[step] - at) / decision.memory_seconds)
            held, before, at = kept * held + course[step] - before, course[step], courses.seconds[step]
            if decision.stop_at is not None and softmax(held).max() >= decision.stop_at:
                break
        if decision.decision_noise:
            total += softmax(held / decision.decision_noise)
        else:
            total[np.argmax(held)] += 1.0
    total /= courses.repeats
    return (1.0 - decision.lapse) * total + decision.lapse / len(total)


@pytest.mark.parametrize(
    "decision",
    [
        Decision(),
        Decision(memory_seconds=0.8),
        Decision(decision_noise=1.5, lapse=0.2),
        Decision(stop_at=0.6),
        Decision(stop_at=0.7, memory_seconds=1.0, lapse=0.1),
    ],
)
@pytest.mark.parametrize("seconds", [0.25, 2.0, 6.0])
def test_answers_are_those_of_a_loop_over_repeats(courses, decision, seconds):
    for level in (0, 3):
        found = decision.response_probabilities(courses, 2, SIGMAS[level], seconds)
        np.testing.assert_allclose(found, plain(courses, decision, 2, level, seconds), atol=1e-9)


@pytest.mark.parametrize("decision", [Decision(stop_at=0.8), Decision(price=0.05), Decision()])
def test_the_joint_of_answers_and_times_adds_to_one(courses, decision):
    seconds, joint = decision.answers(courses, 1, 2.7, 4.1)
    assert joint.sum() == pytest.approx(1.0)
    assert seconds[-1] == 4.1
    assert len(seconds) == len(joint)
    assert (joint >= 0.0).all()


def test_a_sigma_between_two_is_between_them(courses):
    low, middle, high = (Decision().response_probabilities(courses, 0, s, 3.0)[0] for s in (2.0, math.sqrt(8.0), 4.0))
    assert middle == pytest.approx(0.5 * (low + high))


def test_what_everybody_knows_of_the_limits(courses):
    ideal, cell = Decision(), 1
    right = [ideal.response_probabilities(courses, cell, s, 6.0)[cell] for s in SIGMAS]
    assert right == sorted(right, reverse=True)
    np.testing.assert_allclose(Decision(lapse=1.0).response_probabilities(courses, cell, 1.0, 6.0), 0.25)
    np.testing.assert_allclose(
        Decision(decision_noise=1e6).response_probabilities(courses, cell, 1.0, 6.0), 0.25, atol=1e-4
    )
    np.testing.assert_allclose(ideal.response_probabilities(courses, cell, 1.0, 1e-9), 0.25, atol=0.5)
    np.testing.assert_allclose(
        Decision(memory_seconds=1e8).response_probabilities(courses, cell, 2.0, 6.0),
        ideal.response_probabilities(courses, cell, 2.0, 6.0),
    )


@pytest.mark.parametrize("prior", [(0.25, 0.25, 0.25, 0.25), (0.5, 0.3, 0.1, 0.1), (0.6, 0.4, 0.0, 0.0)])
def test_what_is_forgotten_leaves_the_prior(prior: tuple[float, ...]):
    """The prior, the first row of courses that begin at 0 s, is no evidence: belief is prior · exp(E)."""
    rng, seconds, memory = np.random.default_rng(900_401), np.arange(6.0), 1.5
    with np.errstate(divide="ignore"):
        ideal = np.log(prior) + np.concatenate([np.zeros((2, 1, 4)), rng.normal(size=(2, 5, 4)).cumsum(axis=1)], axis=1)
    ideal -= np.logaddexp.reduce(ideal, axis=-1, keepdims=True)
    courses = Courses(
        names=("cube", "sphere", "cone", "none"), objects=("cube",), conditions=("",), sigmas=np.array([3.0]),
        seconds=seconds, log_posterior=ideal[None, None],
    )  # fmt: skip
    told, held = np.zeros((2, 4)), evidence.held(courses, memory)[0, 0]
    for step in range(1, len(seconds)):
        with np.errstate(invalid="ignore"):
            told = np.exp(-1.0 / memory) * told + np.nan_to_num(ideal[:, step] - ideal[:, step - 1])
        wanted = np.exp(told) * prior
        wanted /= wanted.sum(axis=-1, keepdims=True)
        np.testing.assert_allclose(softmax(held[:, step], axis=-1), wanted, atol=1e-12)
    np.testing.assert_allclose(softmax(held[:, 0], axis=-1), [prior] * 2, atol=1e-12)


def test_equal_evidence_is_decided_by_lot():
    np.testing.assert_allclose(choices(np.array([1.0, 1.0, 0.0]), 0.0), [0.5, 0.5, 0.0])
    assert np.isnan(choices(np.full(3, np.nan), 0.0)).all()


def test_the_dearer_time_the_sooner_the_answer(courses):
    def mean(price: float) -> float:
        seconds, joint = Decision(price=price).answers(courses, 0, 2.0, 6.0)
        return float(seconds @ joint.sum(axis=1))

    times = [mean(price) for price in (1e-6, 0.05, 0.2, 2.0)]
    assert times == sorted(times, reverse=True)
    assert times[-1] == courses.seconds[0]  # not before anything was felt


def test_a_price_stops_where_dynamic_programming_over_a_coin_does():
    """p is worth 1 - p gains with probability g a step, so that to go on is worth g (1 - p) - price: the bound is
    1 - price / g."""
    rng, gain, price, steps = np.random.default_rng(900_102), 0.3, 0.09, 12
    best = np.empty((1, 1, 40_000, steps))
    best[..., 0] = rng.uniform(0.3, 1.0, best.shape[2])
    for step in range(1, steps):
        best[..., step] = np.where(rng.random(best.shape[:3]) < gain, 1.0, best[..., step - 1])
    bounds = stopping.worthwhile(best, np.arange(steps, dtype=np.float64), price)[:, 0]
    assert bounds[-1] == 0.0
    np.testing.assert_allclose(bounds[:-2], 1.0 - price / gain, atol=0.05)


def test_missing_repeats_are_left_out(courses):
    holes = courses.log_posterior.copy()
    holes[0, :, 5:] = np.nan
    some = Courses(**{**vars(courses), "log_posterior": holes})
    fewer = Courses(**{**vars(courses), "log_posterior": courses.log_posterior[:, :, :5]})
    for decision in (Decision(memory_seconds=2.0), Decision(stop_at=0.7)):
        found, wanted = (decision.response_probabilities(each, 0, 3.0, 2.1) for each in (some, fewer))
        np.testing.assert_allclose(found, wanted)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c: Decision(memory_seconds=0.0), "memory_seconds"),
        (lambda c: Decision(lapse=1.2), "lapse must be .* got 1.2"),
        (lambda c: Decision(stop_at=0.9, price=0.1), "either stop_at or price"),
        (lambda c: Decision().answers(c, 0, 40.0, 1.0), r"\[1, 15\] degrees.* got 40"),
        (lambda c: Decision().answers(c, 9, 4.0, 1.0), "cell"),
        (lambda c: Decision().answers(c, 0, 4.0, 7.0), r"\[0, 6\] s.* got 7"),
        (lambda c: evidence.between(c.sigmas, [0.5]), "got 0.5"),
    ],
)
def test_what_cannot_be_is_refused(courses, call, words):
    with pytest.raises(ValueError, match=words):
        call(courses)
