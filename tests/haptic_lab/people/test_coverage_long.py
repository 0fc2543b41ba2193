"""How often intervals of d' and of thresholds hold the truth.

python -m pytest -m statistical -s tests/haptic_lab/people/test_coverage_long.py
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from haptic_lab.people.detection import forced_choice, share_correct
from haptic_lab.people.studies import discrimination, presets

pytestmark = [pytest.mark.statistical, pytest.mark.timeout(3600)]
RUNS, TRIALS = 400, 300
LEAST = 0.92  # of 400 intervals of 95 %, less three SDs


@pytest.mark.parametrize("alternatives", [2, 4])
@pytest.mark.parametrize("truth", [1.0, 2.0])
def test_of_d_prime(truth: float, alternatives: int) -> None:
    rng = np.random.default_rng([74_000, alternatives, int(truth)])
    share = float(share_correct(truth, alternatives))
    held = 0
    for correct in rng.binomial(TRIALS, share, RUNS):
        found = forced_choice(int(correct), TRIALS, alternatives, seed=int(rng.integers(2**31)))
        low, high = found.d_prime_interval
        held += low <= truth <= high
    print(f"d' of {truth:g} among {alternatives}: {held} of {RUNS} intervals hold it")
    assert held >= LEAST * RUNS


def test_of_thresholds() -> None:
    """Evidence is Gaussian, d' in proportion to the distance from the standard; 20 explorations of each stimulus."""
    study, rng = presets.read("aspect_ratio"), np.random.default_rng(74_001)
    truth = study.standard + 0.03
    one = float(np.interp(0.75, share_correct(grid := np.linspace(0.0, 3.0, 3001), 2), grid))  # d' of 75 % right
    held, runs = 0, 60
    for _ in range(runs):
        lines = []
        standard = rng.standard_normal(20)
        for value, _ in study.comparisons:
            d = one * (value - study.standard) / (truth - study.standard)
            evidence = d * (rng.standard_normal(20) + d) - d * d / 2.0, d * standard - d * d / 2.0
            correct, trials = discrimination.right(*evidence, study.intervals)
            lines.append(("", "ideal", 10.0, 1.0, value, round(correct), trials))
        counts = pd.DataFrame(lines, columns=discrimination.COUNTS)
        found = discrimination.thresholds(counts, study).iloc[0]
        held += found["low"] <= truth <= found["high"]
    print(f"thresholds: {held} of {runs} intervals hold the truth")
    assert held >= 52  # of 95 %, less three SDs
