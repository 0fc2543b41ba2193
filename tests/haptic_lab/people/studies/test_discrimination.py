"""What observers answer where stimuli are compared: against closed forms, and against an observer that is known."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from haptic_lab.people.detection import share_correct
from haptic_lab.people.studies import adaptive, discrimination, pictures, presets, report

STUDY = presets.read("aspect_ratio")
SENSITIVITY = norm.ppf(0.75) * math.sqrt(2.0) / 0.05  # d' of one unit: 75 % of 1.05 are right in two intervals


@pytest.mark.parametrize("intervals", [2, 3, 4])
@pytest.mark.parametrize("d_prime", [0.0, 1.0, 2.0])
def test_an_ideal_observer_is_right_as_often_as_closed_forms_have_it(intervals: int, d_prime: float) -> None:
    rng = np.random.default_rng(1)
    felt, others = rng.normal(d_prime, 1.0, 2000), rng.normal(0.0, 1.0, 2000)
    correct, trials = discrimination.right(felt, others, intervals)
    assert trials == 2000
    assert correct / trials == pytest.approx(float(share_correct(d_prime, intervals)), abs=0.02)


def test_of_one_interval_each_stimulus_is_a_trial() -> None:
    assert discrimination.right(np.array([1.0, -1.0, 2.0]), np.array([-1.0, 0.5]), 1) == (3, 5)


@pytest.mark.parametrize("intervals", [2, 3])
def test_explorations_of_one_seed_are_never_compared(intervals: int) -> None:
    for own in range(6):
        felt, others = np.full(6, 2.0), np.full(6, -1.0)
        felt[own], others[own] = 0.0, 1.0  # so that this seed is wrong where it meets itself alone
        assert discrimination.right(felt, others, intervals) == (6, 6)
    assert discrimination.right(felt[:1], others[:1], intervals) == (0, 0)


def test_all_that_can_be_put_together_is() -> None:
    felt, others = np.array([1.0, 3.0, 5.0, 7.0]), np.array([0.0, 2.0, 4.0, 6.0])
    pairs = [felt[i] > others[k] for i in range(4) for k in range(4) if i != k]
    assert discrimination.right(felt, others, 2) == (pytest.approx(4 * np.mean(pairs)), 4)


def _rows(sigmas: dict[float, float], count: int = 300) -> pd.DataFrame:
    """Of an observer whose evidence is normal: by sigma how much less sensitive it is."""
    rng, rows = np.random.default_rng(2), []
    for sigma, worse in sigmas.items():
        for value, shape in STUDY.stimuli:
            for seed in range(count):
                felt = value - 1.0 + rng.normal(0.0, worse / SENSITIVITY)
                logs = {each: -0.5 * ((felt - x + 1.0) * SENSITIVITY / worse) ** 2 for x, each in STUDY.stimuli}
                most = max(logs.values())
                p = {f"p_{name}": math.exp(log - most) for name, log in logs.items()}
                told = {"condition": "", "observer": "haptic_slam", "seconds": 10.0, "sigma_deg": sigma}
                rows.append({**told, "shape": shape, "seed": seed, **p})
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    return _rows({1.0: 0.5, 2.0: 1.0, 4.0: 2.0})


@pytest.fixture(scope="module")
def lines(rows: pd.DataFrame) -> pd.DataFrame:
    return discrimination.thresholds(discrimination.counted(rows, STUDY), STUDY)


def test_thresholds_are_found(lines: pd.DataFrame) -> None:
    assert lines["sigma_deg"].tolist() == [1.0, 2.0, 4.0]
    for line, true in zip(lines.itertuples(), (1.025, 1.05, 1.1), strict=True):
        assert line.threshold - 1.0 == pytest.approx(true - 1.0, rel=0.2)
        assert line.low < line.threshold < line.high
    assert (lines["trials"] == 1500).all()
    assert lines["within"].all()


def test_the_noise_at_which_an_observer_has_the_threshold_of_people(lines: pd.DataFrame) -> None:
    figure = replace(STUDY.published[0], value=1.05)
    (found,) = discrimination.reached(lines, figure, 1.0)
    assert found["sigma_deg"] == pytest.approx(2.0, rel=0.2)
    assert found["low"] < found["sigma_deg"] < found["high"]
    (never,) = discrimination.reached(lines, replace(figure, value=1.5), 1.0)
    assert math.isnan(never["sigma_deg"])
    assert never["better"]
    assert not found["better"]


@pytest.mark.parametrize(
    ("right", "stimuli", "told"),
    [(1.0, None, "none: all right"), (0.0, None, "none: all wrong"), (0.5, 2, "none: fewer than 3 stimuli")],
)
def test_why_there_is_no_threshold_is_told(rows: pd.DataFrame, right: float, stimuli: int | None, told: str) -> None:
    counts = discrimination.counted(rows[rows["sigma_deg"] == 1.0], STUDY).iloc[:stimuli].copy()
    counts["correct"] = right * counts["trials"]
    (line,) = discrimination.thresholds(counts, STUDY).itertuples()
    assert math.isnan(line.threshold)
    assert not line.within
    assert report._threshold(line, STUDY) == told


@pytest.mark.parametrize(
    ("standard", "ends", "told"),
    [
        (1.0, (1.0184, 1.0074, 1.0269), "1.018 [1.007, 1.027]"),
        (1.0, (1.102, 1.041, 1.139), "1.10 [1.04, 1.14]"),
        (40.0, (41.64, 40.58, 42.5), "41.6 [40.6, 42.5]"),
        (90.0, (118.4, 101.0, 130.0), "118 [101, 130]"),
    ],
)
def test_a_threshold_has_two_digits_of_its_distance(standard: float, ends: tuple[float, ...], told: str) -> None:
    line = pd.Series(dict(zip(discrimination.ENDS, ends, strict=True)) | {"within": True})
    assert report._threshold(line, SimpleNamespace(standard=standard)) == told  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [RuntimeError, AssertionError, KeyError])
def test_what_psignifit_cannot_take_is_told(
    rows: pd.DataFrame, kind: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refusing(*args: object, **keywords: object) -> None:
        raise kind("no grid\nfor these")

    monkeypatch.setattr("psignifit.psignifit", refusing)
    counts = discrimination.counted(rows[rows["sigma_deg"] == 1.0], STUDY)
    with pytest.raises(ValueError, match=r"psignifit cannot fit these levels: .*no grid"):
        discrimination.thresholds(counts, STUDY)


def test_the_picture_shows_people_and_observers(lines: pd.DataFrame) -> None:
    (axes,) = pictures.thresholds(lines, STUDY).axes
    assert {"1.02", "1.05", "1.1"} <= {each.get_text() for each in axes.get_yticklabels()}
    names = axes.get_legend_handles_labels()[1]
    assert names == ["people, 1.03", "haptic SLAM"]
    none = lines.assign(observer="ceiling", within=False, **dict.fromkeys(discrimination.ENDS, math.nan))
    figure = pictures.thresholds(pd.concat([lines, none]), STUDY)
    assert [each.get_text() for each in figure.legends[0].get_texts()] == names  # who has no point is not in it


def test_what_was_no_candidate_is_refused(rows: pd.DataFrame) -> None:
    with pytest.raises(ValueError, match=r"'ellipsoid\(1\.06, 1, 1\)' was no candidate"):
        discrimination.counted(rows.drop(columns="p_ellipsoid(1.06, 1, 1)"), STUDY)


def test_a_staircase_agrees_with_constant_stimuli_about_the_same_observer(lines: pd.DataFrame) -> None:
    rng = np.random.default_rng(3)

    def answer(value: float, number: int) -> bool:
        return bool(rng.normal((value - 1.0) * SENSITIVITY, 1.0) > rng.normal())

    found = adaptive.staircase(STUDY, answer, 150)
    constant = lines[lines["sigma_deg"] == 2.0].iloc[0]
    assert found.low < constant["threshold"] < found.high
    assert found.low < 1.05 < found.high
    assert found.threshold - 1.0 == pytest.approx(0.05, rel=0.35)
    assert len(found.values) == len(found.answers) == 150


@pytest.mark.parametrize("trials", [0, -1, 2.5, "many"])
def test_a_staircase_has_trials(trials: object) -> None:
    with pytest.raises(ValueError, match="trials must be"):
        adaptive.staircase(STUDY, lambda value, number: True, trials)  # type: ignore[arg-type]
