"""d′ against closed forms and an integral of another kind, its intervals, and efficiency."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from haptic_lab.people.detection import Sensitivity, d_prime_of, efficiency, forced_choice, share_correct, yes_no

# From here on, at most 1 % of d′ is asked for; what is found is the same to seven digits.


@pytest.mark.parametrize("d_prime", [-1.0, 0.0, 0.5, 1.0, 2.0, 4.0])
def test_two_alternatives_are_the_closed_form(d_prime: float) -> None:
    share = float(share_correct(d_prime, 2))
    assert share == pytest.approx(norm.cdf(d_prime / math.sqrt(2)), abs=1e-12)
    assert d_prime_of(share, 2) == pytest.approx(d_prime, abs=1e-6)


@pytest.mark.parametrize("alternatives", [3, 4, 8])
@pytest.mark.parametrize("d_prime", [0.5, 1.5, 3.0])
def test_several_alternatives_are_the_probability_that_the_signal_beats_each(alternatives: int, d_prime: float) -> None:
    others = alternatives - 1
    covariance = 0.5 * (np.eye(others) + 1.0)  # of the differences, in units of their SD
    beats = multivariate_normal.cdf(np.full(others, d_prime / math.sqrt(2)), cov=covariance, rng=0)
    assert float(share_correct(d_prime, alternatives)) == pytest.approx(beats, abs=3e-5)
    assert d_prime_of(float(beats), alternatives) == pytest.approx(d_prime, rel=0.01)


@pytest.mark.parametrize("alternatives", [2, 3, 10, 1000])
def test_without_any_signal_it_is_chance(alternatives: int) -> None:
    assert float(share_correct(0.0, alternatives)) == pytest.approx(1 / alternatives, rel=1e-9)


def test_yes_and_no_are_the_textbook_with_the_log_linear_correction() -> None:
    found = yes_no(80, 100, 30, 100)
    hit, alarm = norm.ppf([80.5 / 101, 30.5 / 101])
    assert found.d_prime == pytest.approx(hit - alarm)
    assert found.criterion == pytest.approx(-(hit + alarm) / 2)
    for value, (low, high) in (
        (found.d_prime, found.d_prime_interval),
        (found.criterion, found.criterion_interval),
    ):
        assert low < value < high
    # Of the normal approximation: var z = p (1 - p) / (n φ²).
    half = 1.96 * math.sqrt(sum(p * (1 - p) / (100 * norm.pdf(norm.ppf(p)) ** 2) for p in (0.8, 0.3)))
    low, high = found.d_prime_interval
    assert (high - low) / 2 == pytest.approx(half, rel=0.07)


@pytest.mark.parametrize("found", [yes_no(50, 50, 0, 50), forced_choice(50, 50, 4)])
def test_of_someone_who_is_always_right_only_a_lower_bound_is_known(found: Sensitivity) -> None:
    low, high = found.d_prime_interval
    assert found.perfect
    assert 1.5 < low < found.d_prime < high == math.inf


@pytest.mark.parametrize("alternatives", [2, 4])
@pytest.mark.parametrize("d_prime", [1.0, 2.0])
def test_intervals_hold_the_truth_as_often_as_they_say(alternatives: int, d_prime: float) -> None:
    rng, share, held = np.random.default_rng(900001), float(share_correct(d_prime, alternatives)), []
    for seed in range(200):
        low, high = forced_choice(int(rng.binomial(300, share)), 300, alternatives, seed=seed).d_prime_interval
        held.append(low <= d_prime <= high)
    assert 0.90 <= np.mean(held) <= 0.99


@pytest.mark.parametrize("alternatives", [2, 4])
def test_an_ideal_subject_has_an_efficiency_of_one_within_its_interval(alternatives: int) -> None:
    rng, share, held, values = np.random.default_rng(900002), float(share_correct(1.5, alternatives)), [], []
    for seed in range(200):
        person = forced_choice(int(rng.binomial(300, share)), 300, alternatives, seed=seed)
        observer = forced_choice(int(rng.binomial(2000, share)), 2000, alternatives, seed=seed)
        value, low, high = efficiency(person, observer)
        values.append(value)
        held.append(low <= 1.0 <= high)
    assert np.mean(values) == pytest.approx(1.0, abs=0.03)
    assert 0.90 <= np.mean(held) <= 0.99


def test_half_of_the_d_prime_is_a_quarter_of_the_efficiency() -> None:
    ideal = forced_choice(round(float(share_correct(2.0, 4)) * 100_000), 100_000, 4)
    group = [forced_choice(round(float(share_correct(d, 4)) * 100_000), 100_000, 4) for d in (0.8, 0.9, 1.0, 1.1, 1.2)]
    value, low, high = efficiency(group, ideal)
    assert value == pytest.approx(0.25, abs=0.003)
    assert low < 0.23 < 0.27 < high  # over subjects, who differ more than their trials say


def test_subjects_who_happen_to_be_alike_are_no_surer_than_their_trials() -> None:
    alike = [forced_choice(50, 60, 4)] * 2
    _, low, high = efficiency(alike, forced_choice(90_000, 100_000, 4))
    assert high - low > 0.2


@pytest.mark.parametrize("subjects", [4, 12])
def test_intervals_over_subjects_hold_the_mean(subjects: int) -> None:
    rng, held = np.random.default_rng(900005), []
    for seed in range(120):
        truth = rng.normal(1.5, 0.4, subjects)
        right = rng.binomial(200, share_correct(truth, 4))
        people = [forced_choice(int(each), 200, 4) for each in right]
        _, low, high = efficiency(people, forced_choice(7_000, 10_000, 4), seed=seed)
        held.append(low <= (1.5 / d_prime_of(0.7, 4)) ** 2 <= high)
    assert np.mean(held) >= 0.9


@pytest.mark.parametrize("people", [forced_choice(30, 50, 4), [forced_choice(30, 50, 4), forced_choice(35, 50, 4)]])
def test_of_an_observer_without_mistakes_no_efficiency_is_made_up(people) -> None:
    value, low, high = efficiency(people, forced_choice(200, 200, 4))
    assert math.isnan(value)
    assert low == 0.0
    assert 0.05 < high < 0.5  # d′ of people is 1.3 and 1.5, and that of the observer above 3


@pytest.mark.parametrize("people", [forced_choice(24, 24, 3), [forced_choice(24, 24, 3), forced_choice(30, 30, 3)]])
def test_of_people_without_mistakes_only_a_lower_bound_is_told(people) -> None:
    value, low, high = efficiency(people, forced_choice(70, 100, 3))
    assert math.isnan(value)
    assert low > 1.0
    assert math.isinf(high)
    value, low, high = efficiency(people, forced_choice(100, 100, 3))  # of which nothing is known
    assert math.isnan(value)
    assert (low, high) == (0.0, math.inf)


def test_below_chance_is_no_efficiency_and_of_one_subject_no_group_is_known() -> None:
    ideal = forced_choice(80, 100, 2)
    assert efficiency(forced_choice(10, 100, 2), ideal) == (0.0, 0.0, 0.0)
    value, low, high = efficiency([forced_choice(70, 100, 2)], ideal)
    assert value > 0.0
    assert math.isnan(low)
    assert math.isnan(high)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: yes_no(11, 10, 0, 10), "hits of 10 signals must be an integer in [0, 10], got 11"),
        (lambda: yes_no(1, 0, 0, 10), "signals must be an integer in [1, "),
        (lambda: forced_choice(1, 10, 1), "alternatives must be an integer in [2, 1000], got 1"),
        (lambda: d_prime_of(1.0, 2), "share must be a finite number in (0, 1), got 1.0, at which d′ is infinite"),
        (lambda: d_prime_of(0.0, 2), "share must be"),
        (lambda: share_correct(math.nan, 2), "d_prime must be"),
        (lambda: efficiency([], forced_choice(1, 2, 2)), "people must be one person at least"),
    ],
)
def test_what_cannot_be_is_refused(call, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        call()
