"""The curves against what the table was made to say."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from haptic_lab.analysis import reliability


def table(ranks: list[np.ndarray], names: list[tuple[str, float]]) -> pd.DataFrame:
    """A trial for each of `ranks`; `names`: the true shape and the probability of cube."""
    rows = []
    for trial, (counts, (shape, cube)) in enumerate(zip(ranks, names, strict=True)):
        rows.append(
            {
                "sigma_deg": 3.0,
                "observer": "haptic_slam",
                "shape": shape,
                "seed": trial,
                "ranks_lagged": " ".join(map(str, counts)),
                "ranks_online": " ".join(["5"] * 40),
                "skin_cells": "100 0 10" if trial == 0 else "300 0 30",
                "skin_cells_predicted": "0.1 nan 0.9",
                "skin_cells_observed": "0.2 nan 1" if trial == 0 else "0 nan 0.6",
                "candidates": "cube sphere",
                "p_cube": cube,
                "p_sphere": 1 - cube,
            }
        )
    return pd.DataFrame(rows)


@pytest.fixture
def rows() -> pd.DataFrame:
    ends = np.zeros(40, dtype=int)
    ends[[0, 39]] = 20
    middle = np.zeros(40, dtype=int)
    middle[[17, 22]] = 20  # just outside the middle tenth, inside the middle fifth
    return table([ends, middle], [("cube", 0.9), ("cube", 0.95)])


def curve(rows: pd.DataFrame, what: str) -> pd.DataFrame:
    lines = reliability.curves(rows)
    return lines[lines["what"] == what].set_index("said")


def test_coverage_is_the_share_of_ranks_in_the_middle(rows: pd.DataFrame) -> None:
    lagged, online = curve(rows, reliability.LAGGED), curve(rows, reliability.ONLINE)
    assert lagged.loc[0.1, "found"] == 0.0
    assert lagged.loc[0.2, "found"] == 0.5
    assert lagged.loc[0.95, "found"] == 0.5
    assert lagged.loc[0.95, "low"] < 0.5 < lagged.loc[0.95, "high"]
    np.testing.assert_allclose(online["found"], online.index)
    assert (online["count"] == 2).all()


def test_cells_are_pooled_over_trials(rows: pd.DataFrame) -> None:
    found = curve(rows, reliability.OCCUPANCY)
    np.testing.assert_allclose(found.index, [0.1, 0.9])
    np.testing.assert_allclose(found["found"], [0.05, 0.7])
    assert found["count"].tolist() == [400, 40]
    np.testing.assert_allclose(found["low"], [0.0, 0.6])
    np.testing.assert_allclose(found["high"], [0.2, 1.0])


def test_every_label_s_probability_counts(rows: pd.DataFrame) -> None:
    found = curve(rows, reliability.NAME)
    np.testing.assert_allclose(found.index, [0.075, 0.925])
    np.testing.assert_allclose(found["found"], [0.0, 1.0])
    assert found["count"].tolist() == [2, 2]


def test_pictures_and_table_are_written(rows: pd.DataFrame, tmp_path) -> None:
    both = pd.concat([rows, rows.assign(observer="floor", sigma_deg=3.0)])
    names = reliability.save(both, tmp_path)
    assert names == ["calibration.csv", "calibration_haptic_slam.png", "calibration_floor.png"]
    assert all((tmp_path / name).stat().st_size > 100 for name in names)
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "calibration.csv"), reliability.curves(both))
