"""New objects among known ones: what the table says against what it was made to say."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
import pytest

from haptic_lab.analysis import novelty, reliability
from haptic_lab.figures import confusion
from haptic_lab.sweeps.results import labels_in, right_names


@pytest.mark.parametrize("seed", range(3))
def test_area_counts_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    said, new = rng.integers(0, 6, 40) / 5, rng.random(40) < 0.4  # with ties
    pairs = [float(a > b) + 0.5 * (a == b) for a, b in itertools.product(said[new], said[~new])]
    assert novelty.auroc(said, new) == pytest.approx(np.mean(pairs))


@pytest.mark.parametrize("new", [True, False])
def test_no_area_without_both_kinds(new: bool) -> None:
    assert np.isnan(novelty.auroc(np.array([0.1, 0.9]), np.array([new, new])))


def test_calibration_error_of_names_is_weighted_by_how_many() -> None:
    sure, hit = np.array([0.85, 0.85, 0.85, 0.55, 1.0]), np.array([True, True, False, True, True])
    assert novelty.ece(sure, hit) == pytest.approx((3 * abs(0.85 - 2 / 3) + abs(0.55 - 1) + 0) / 5)


@pytest.fixture
def rows() -> pd.DataFrame:
    """A cube that is named, one that is taken for new, a torus that is found to be new, and one that is not."""
    said = {"cube": (0.9, 0.3, 0.1, 0.6), "sphere": (0.05, 0.1, 0.1, 0.3), "none": (0.05, 0.6, 0.8, 0.1)}
    return pd.DataFrame(
        {
            "sigma_deg": 3.0,
            "observer": "haptic_slam",
            "shape": ["cube", "cube", "torus", "torus"],
            "seed": range(4),
            "candidates": "cube sphere",
            **{f"p_{label}": p for label, p in said.items()},
            "shape_posterior": ["cube", "none", "none", "cube"],
        }
    )


def test_what_is_right_to_say(rows: pd.DataFrame) -> None:
    assert labels_in(rows) == ["cube", "sphere", "none"]
    assert right_names(rows) == ["cube", "cube", "none", "none"]
    certain = rows.drop(columns="p_none")
    assert right_names(certain) == list(certain["shape"])


def test_summary(rows: pd.DataFrame) -> None:
    lines = novelty.summarise(rows).set_index("measure")
    assert lines.loc["new_auroc", "mean"] == pytest.approx(3 / 4)
    assert lines.loc["name_ece", "mean"] == pytest.approx(
        novelty.ece(np.array([0.9, 0.6, 0.8, 0.6]), np.array([True, False, True, False]))
    )
    assert (lines["low"] <= lines["mean"]).all()
    assert (lines["mean"] <= lines["high"]).all()
    assert (lines["trials"] == 4).all()


def test_names_of_new_objects_are_right_where_they_are_called_new(rows: pd.DataFrame) -> None:
    right = sum(share * count for _, _, share, _, _, count in reliability._name(rows))
    assert right == pytest.approx(4.0), "one name of each trial"
    shares = confusion.table(rows).set_index(["shape", "named"])["share"]
    assert shares["none", "none"] == 0.5
    assert shares["none", "cube"] == 0.5
    assert shares["cube", "cube"] == 0.5
