"""Agreement trial by trial: against sums that are done by hand, and with nobody to agree with."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy import stats
from sklearn.metrics import cohen_kappa_score, mutual_info_score

from haptic_lab.people.agreement import kappa, log_likelihoods, shared_bits, time_correlation

NAMES = ("cube", "sphere", "cone")
SAID = ["cube", "cube", "sphere", "cone", "sphere", "cube"]
OTHER = ["cube", "sphere", "sphere", "cone", "cone", "cube"]


def certain(answers: list[str]) -> np.ndarray:
    return np.array([[float(name == each) for name in NAMES] for each in answers])


def test_the_likelihood_is_a_mixture_of_what_is_believed_and_any_answer() -> None:
    found = log_likelihoods(["cube", "cone"], [[0.7, 0.2, 0.1], [1.0, 0.0, 0.0]], NAMES, 0.03)
    np.testing.assert_allclose(found, np.log([0.97 * 0.7 + 0.01, 0.01]))
    assert log_likelihoods(["cone"], [[1.0, 0.0, 0.0]], NAMES, 0.0)[0] == -math.inf


def test_kappa_of_single_answers_is_that_of_two_lists() -> None:
    assert kappa(SAID, certain(OTHER), NAMES) == pytest.approx(cohen_kappa_score(SAID, OTHER))
    assert kappa(SAID, certain(SAID), NAMES) == pytest.approx(1.0)
    assert kappa(SAID, np.full((6, 3), 1 / 3), NAMES) == pytest.approx(0.0)
    assert math.isnan(kappa(["cube"], certain(["cube"]), NAMES))


def test_information_is_that_of_the_stimulus_or_none() -> None:
    assert shared_bits([*NAMES], certain([*NAMES]), NAMES) == pytest.approx(math.log2(3))
    assert shared_bits(SAID, np.full((6, 3), 1 / 3), NAMES) == pytest.approx(0.0, abs=1e-12)


def test_shares_of_an_answer_count_as_so_many_answers() -> None:
    shares = np.array([[0.5, 0.5, 0.0], [0.25, 0.75, 0.0], [0.0, 0.25, 0.75]])
    said = ["cube", "sphere", "cone"]
    each = [
        (mine, name)
        for mine, row in zip(said, shares, strict=True)
        for name, share in zip(NAMES, row, strict=True)
        for _ in range(round(4 * share))
    ]
    mine, theirs = map(list, zip(*each, strict=True))
    assert shared_bits(said, shares, NAMES) == pytest.approx(mutual_info_score(mine, theirs) / math.log(2))
    assert kappa(said, shares, NAMES) == pytest.approx(cohen_kappa_score(mine, theirs))
    assert shared_bits(["cube"], [[0.5, 0.5, 0.0]], NAMES) == pytest.approx(0.0, abs=1e-12)


def test_times_are_correlated_by_rank_where_both_are_known() -> None:
    rng = np.random.default_rng(900004)
    one = rng.exponential(size=80)
    other = one + rng.exponential(size=80)
    known = stats.spearmanr(one, other).statistic
    found = time_correlation([*one, math.nan, 1.0], [*other, 1.0, math.nan])
    assert found.rho == pytest.approx(known)
    assert found.low < known < found.high
    assert found.trials == 80
    never = np.where(other > 2.5, math.inf, other)  # is later than any
    assert time_correlation(one, never).rho == pytest.approx(stats.spearmanr(one, np.minimum(never, 9.0)).statistic)
    assert math.isnan(time_correlation([1.0, 1.0, 1.0], [1.0, 2.0, 3.0]).rho)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: log_likelihoods(["cup"], [[1.0, 0.0, 0.0]], NAMES), "must be among cube, sphere, cone, got 'cup'"),
        (lambda: log_likelihoods(["cube"], [[1.0, 0.5, 0.0]], NAMES), "shares that add to 1"),
        (lambda: log_likelihoods(["cube"], [[1.0, 0.0]], NAMES), "shape (1, 3)"),
        (lambda: log_likelihoods(["cube"], [[1.0, 0.0, 0.0]], NAMES, 2.0), "floor must be"),
        (lambda: kappa([], np.zeros((0, 3)), NAMES), "responses must be one name or more"),
        (lambda: time_correlation([1.0], [1.0, 2.0]), "times of the same trials"),
    ],
)
def test_what_belongs_to_no_trial_is_refused(call, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        call()
