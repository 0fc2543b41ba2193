"""Psychometric functions: what was put in is found again, and what cannot be fitted is refused."""

from __future__ import annotations

import importlib.util
import math
import re

import numpy as np
import pytest
from scipy.stats import norm

from haptic_lab.people.psychometric import fit_psychometric, level_of

LEVELS = np.array([1.0, 1.05, 1.1, 1.15, 1.2, 1.3])
needs_psignifit = pytest.mark.skipif(importlib.util.find_spec("psignifit") is None, reason="needs the extra people")


@needs_psignifit
@pytest.mark.parametrize(
    ("alternatives", "guess", "lapse", "sign"),
    [(2, 0.5, 0.03, 1), (2, 0.5, 0.03, -1), (None, 0.03, 0.15, 1), (None, 0.03, 0.15, -1)],
)
def test_what_was_put_in_is_within_the_intervals(
    alternatives: int | None, guess: float, lapse: float, sign: int
) -> None:
    psi = guess + (1 - guess - lapse) * norm.cdf(sign * (LEVELS - 1.12) / 0.05)
    trials = np.full(len(LEVELS), 200)
    found = fit_psychometric(LEVELS, np.random.default_rng(900003).binomial(trials, psi), trials, alternatives)
    slope = sign / (0.05 * math.sqrt(2 * math.pi))
    for estimate, truth in ((found.threshold, 1.12), (found.slope, slope), (found.lapse, lapse), (found.guess, guess)):
        assert estimate.low <= truth <= estimate.high
        assert estimate.low <= estimate.value <= estimate.high
    assert found.threshold.high - found.threshold.low < 0.05
    np.testing.assert_allclose(found.share(LEVELS), psi, atol=0.06)


@pytest.mark.parametrize(
    ("levels", "counted", "trials", "said"),
    [
        ([1, 2], [1, 2], [5, 5], "levels must be 3 different ones at least, that were tried, got 2"),
        ([1, 2, 3], [1, 2, 0], [5, 5, 0], "3 different ones at least, that were tried, got 2"),
        ([1, 2, 3], [5, 5, 5], [5, 5, 5], "counted must differ between trials, got 15 of 15"),
        ([1, 2, 3], [0, 0, 0], [5, 5, 5], "counted must differ between trials, got 0 of 15"),
        ([1, 2, 3], [1, 2, 6], [5, 5, 5], "must be whole numbers, 0 <= counted <= trials"),
        ([1, 2, 3], [1, 2, 2.5], [5, 5, 5], "must be whole numbers, 0 <= counted <= trials"),
        ([1, math.nan, 3], [1, 2, 2], [5, 5, 5], "levels must be"),
    ],
)
def test_what_has_no_threshold_is_refused(levels, counted, trials, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        fit_psychometric(levels, counted, trials)


@pytest.mark.parametrize(
    ("objects", "what", "levels"),
    [
        (["ellipsoid(1.1)", "ellipsoid(1.2)", "ellipsoid"], "ellipsoid x", [1.1, 1.2, 1.0]),
        (["cuboid(1, 1, 1.1)", "cuboid(1, 1, 1.2)"], "cuboid z", [1.1, 1.2]),
        (["cube(size=0.03)", "cube(size=0.06)"], "cube size", [0.03, 0.06]),
    ],
)
def test_the_parameter_that_varies_is_found(objects: list[str], what: str, levels: list[float]) -> None:
    assert level_of(objects) == (what, dict(zip(objects, levels, strict=True)))


@pytest.mark.parametrize(
    "objects", [["cube", "sphere"], ["ellipsoid(1.1)", "ellipsoid(1.2, 1.1)"], ["cube"], ["mug.stl"]]
)
def test_what_varies_in_nothing_or_in_several_ways_is_refused(objects: list[str]) -> None:
    with pytest.raises(ValueError, match=objects[-1].partition("(")[0]):
        level_of(objects)
