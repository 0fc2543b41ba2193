"""Variants are compared trial by trial."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from haptic_lab.analysis import ablation


@pytest.fixture
def rows() -> pd.DataFrame:
    """Trials that differ a lot, a variant that is worse by a little in each, and one that is the same."""
    rng, lines = np.random.default_rng(0), []
    for seed in range(10):
        base = rng.uniform(1, 3)
        lag = 0.1 + 0.01 * rng.random()
        for observer, worse in (
            ("haptic_slam", 0.0),
            ("no_lag", lag),
            ("one_particle", 0.0),
            ("no_lag+no_prior", lag + 0.3),
            ("paper+no_lag", 0.2),
        ):
            lines.append(
                {
                    "sigma_deg": 5.0,
                    "shape": "cube",
                    "seed": seed,
                    "observer": observer,
                    "pose_error_lagged_deg": base + worse,
                    "pose_error_online_deg": base,
                    "coverage_90_lagged": 0.9,
                    "surface_f_score_1": 0.5 - worse,
                    "growing_f_score_1": 0.4,
                    "skin_brier": 0.1,
                    "growing_brier": 0.1,
                    "correct_2s": 1.0,
                }
            )
    return pd.DataFrame(lines)


def test_differences_are_those_of_the_same_trial(rows: pd.DataFrame) -> None:
    lines = ablation.compare(rows).set_index(["observer", "measure"])
    worse = lines.loc["no_lag", "pose_error_lagged"]
    assert 0.1 / 5 < worse["low"] < worse["difference"] < worse["high"] < 0.11 / 5
    assert worse["half"] > 10 * (worse["high"] - worse["low"]), "trials differ more than variants"
    full = rows[rows["observer"] == "no_lag"]["pose_error_lagged_deg"].mean() / 5
    assert worse["mean"] == pytest.approx(full)
    assert lines.loc["one_particle", "pose_error_lagged"]["difference"] == 0
    assert lines.loc["haptic_slam", "skin_brier"]["trials"] == 10


def test_a_further_change_is_compared_with_what_is_without_it(rows: pd.DataFrame) -> None:
    lines = ablation.compare(rows).set_index(["observer", "measure"])
    further = lines.loc["no_lag+no_prior", "surface_f_score_1"]
    assert further["reference"] == "no_lag"
    assert further["difference"] == pytest.approx(-0.3)
    assert lines.loc["paper+no_lag", "surface_f_score_1"]["reference"] == "haptic_slam", "the paper's is not there"


def test_what_is_surely_worse_is_seen() -> None:
    assert ablation._colour(0.1, 0.2, False) == ablation.WORSE
    assert ablation._colour(0.1, 0.2, True) == ablation.BETTER
    assert ablation._colour(-0.2, -0.1, True) == ablation.WORSE
    assert len({ablation._colour(-0.1, 0.2, True), ablation._colour(0.1, 0.2, None), ablation.WORSE}) == 2


def test_one_table_and_a_picture(rows: pd.DataFrame, tmp_path) -> None:
    ablation.save(rows, tmp_path)
    assert (tmp_path / "ablation.png").stat().st_size > 1000
    console = Console(width=200, record=True, file=io.StringIO())
    ablation.print_table(tmp_path / "ablation.csv", console)
    told = console.export_text()
    assert told.count("mean of haptic_slam ± 95 %") == 1
    for name in ("haptic_slam", "no_lag", "one_particle"):
        assert name in told
    assert "0.5000 ±0.0000" in told
    assert "-0.3000" in told
    assert "+0.0000 ±0.0000" in told
