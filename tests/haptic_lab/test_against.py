"""Differences to the floor, and closures, against what they are by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from haptic_lab.analysis import against
from haptic_lab.sweeps.measures import MEASURES


def table(error: float, f_score: float, count: int = 40) -> pd.DataFrame:
    """Rows of explorations of two shapes, felt by floor, observer and ceiling; the same noise in all three."""
    rng = np.random.default_rng(0)
    common = rng.normal(0.0, 0.05, count)
    rows = []
    for observer, share in (("floor", 0.0), ("haptic_slam", f_score), ("ceiling", 1.0)):
        own = rng.normal(0.0, 0.01, count)
        rows.append(
            pd.DataFrame(
                {
                    "sigma_deg": 3.0,
                    "seconds": 10.0,
                    "shape": ["cube", "sphere"] * (count // 2),
                    "seed": np.arange(count) // 2,
                    "observer": observer,
                    "pose_error_lagged_deg": 3.0 - share * error + common + own,
                    "surface_f_score_1": 0.4 + 0.4 * share + common + own,
                    "coverage_90": 0.9 + own,
                    "time_to_decision": np.where(np.arange(count) < 2, np.nan, 2.0 + share + own),
                }
            )
        )
    return pd.concat(rows, ignore_index=True)


def line(lines: pd.DataFrame, measure: str, shape: str = "all", observer: str = "haptic_slam") -> pd.Series:
    found = lines[(lines["measure"] == measure) & (lines["shape"] == shape) & (lines["observer"] == observer)]
    (row,) = (each for _, each in found.iterrows())
    return row


@pytest.mark.parametrize("shape", ["all", "cube", "sphere"])
def test_a_difference_is_that_of_the_same_explorations(shape: str) -> None:
    rows = table(error=2.0, f_score=0.75)
    mine = line(against.compare(rows, MEASURES), "pose_error_lagged_deg", shape)
    some = rows if shape == "all" else rows[rows["shape"] == shape]
    wide = some.pivot(index=["shape", "seed"], columns="observer", values="pose_error_lagged_deg")
    gaps = (wide["haptic_slam"] - wide["floor"]).to_numpy()
    half = stats.t.ppf(0.975, len(gaps) - 1) * gaps.std(ddof=1) / np.sqrt(len(gaps))
    assert mine["difference"] == pytest.approx(gaps.mean())
    assert (mine["low"], mine["high"]) == pytest.approx((gaps.mean() - half, gaps.mean() + half))
    assert mine["trials"] == len(gaps)


@pytest.mark.parametrize("share", [0.25, 0.75, 1.0])
def test_a_closure_lies_in_its_interval(share: float) -> None:
    mine = line(against.compare(table(2.0, share), MEASURES), "surface_f_score_1")
    assert mine["closure_low"] < mine["closure"] < mine["closure_high"]
    assert mine["closure_low"] < share < mine["closure_high"]
    assert mine["closure_high"] - mine["closure_low"] < 0.1


@pytest.mark.parametrize(
    ("measure", "share", "verdict"),
    [
        ("pose_error_lagged_deg", 0.75, "better"),
        ("pose_error_lagged_deg", -0.75, "worse"),
        ("surface_f_score_1", 0.75, "better"),
        ("surface_f_score_1", -0.75, "worse"),
        ("surface_f_score_1", 0.0, "undecided"),
        ("time_to_decision", 0.75, "worse"),
    ],
)
def test_a_verdict_says_which_way_is_better(measure: str, share: float, verdict: str) -> None:
    assert line(against.compare(table(2.0, share), MEASURES), measure)["verdict"] == verdict


def test_who_has_not_decided_counts_as_decided_at_the_end() -> None:
    mine = line(against.compare(table(2.0, 0.5), MEASURES), "time_to_decision")
    assert mine["floor"] == pytest.approx((38 * 2.0 + 2 * 10.0) / 40, abs=0.02)


def test_what_is_better_neither_way_has_no_verdict() -> None:
    lines = against.compare(table(2.0, 0.5), MEASURES)
    assert "coverage_90" not in set(lines["measure"])
    assert {each for each in MEASURES if against.direction(each) == 0} == {
        "coverage_90", "coverage_90_lagged", "touching_share", "n_eff"
    }  # fmt: skip


def test_between_two_that_are_the_same_there_is_no_closure() -> None:
    rows = table(2.0, 0.5)
    rows["surface_f_score_1"] = 0.8 + np.random.default_rng(1).normal(0.0, 0.05, len(rows))
    lines = against.compare(rows, MEASURES)
    assert np.isnan(line(lines, "surface_f_score_1")["closure"])
    assert np.isfinite(line(lines, "pose_error_lagged_deg")["closure"])


def test_without_a_floor_there_is_nothing_to_say() -> None:
    rows = table(2.0, 0.5)
    assert against.compare(rows[rows["observer"] != "floor"], MEASURES).empty


def test_without_a_ceiling_there_is_no_closure() -> None:
    rows = table(2.0, 0.5)
    assert against.compare(rows[rows["observer"] != "ceiling"], MEASURES)["closure"].isna().all()
