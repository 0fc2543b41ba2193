"""What is found of hundreds of simulated subjects: coverage of intervals, recovery of models, an ideal's efficiency."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_lab.people.comparing import recoveries, recovery_table
from haptic_lab.people.detection import efficiency, forced_choice
from haptic_lab.people.fitting import fit
from haptic_lab.people.models import Model
from haptic_lab.people.simulated import drawn, halves, simulate, subject_of
from tests.haptic_lab.people.made_courses import made

pytestmark = [pytest.mark.statistical, pytest.mark.timeout(3600)]
SECONDS = (0.5, 1.0, 2.0, 4.0, 6.0)
SUBJECTS, TRIALS = 200, 300


def test_intervals_hold_the_truth():
    """Who is simulated explores by itself: 300 trials of 75 repeats; courses of 150 others are fitted."""
    rng = np.random.default_rng(72_001)
    held = []
    for _ in range(SUBJECTS):
        first, second = (made(int(rng.integers(2**31)), repeats) for repeats in (75, 150))
        model = Model.named("limits", second)
        subject = drawn(model, rng)
        found = fit(model, simulate(first, subject, TRIALS, SECONDS, rng))
        ends = {name: found.interval(name)[1:] for name in model.parameters}
        held.append([low <= subject.truth[name] <= high for name, (low, high) in ends.items()])
    coverage = np.mean(held, axis=0)
    print(dict(zip(model.parameters, coverage, strict=True)))
    assert (coverage >= 0.89).all()  # 95 % less two SDs of 200 subjects, and what noise of the repeats takes
    assert (coverage <= 0.99).all()


@pytest.mark.parametrize(("rule", "subjects", "least"), [("stop_at", 100, 0.85), ("price", 30, 0.0)])
def test_intervals_of_a_rule_of_stopping(rule: str, subjects: int, least: float):
    """Who answers when it likes, within 6 s. A price is told of alone: its bounds are too unsure to be found."""
    rng = np.random.default_rng(72_006)
    held = []
    for _ in range(subjects):
        first, second = (made(int(rng.integers(2**31)), repeats) for repeats in (75, 150))
        model = Model(rule, second, ("sigma_deg", rule, "lapse"))
        subject = drawn(model, rng)
        found = fit(model, simulate(first, subject, TRIALS, SECONDS[-1:], rng))
        ends = {name: found.interval(name)[1:] for name in model.parameters}
        held.append([low <= subject.truth[name] <= high for name, (low, high) in ends.items()])
    coverage = np.mean(held, axis=0)
    print(dict(zip(model.parameters, coverage, strict=True)))
    assert (coverage >= least).all()


def test_models_are_recovered_where_their_ranges_are_apart():
    courses, felt = made(72_002, 400), {"sigma_deg": (1.5, 4.0)}
    models = [
        Model.named("ideal", courses, felt),
        Model.named("memory", courses, {**felt, "memory_seconds": (0.3, 0.6)}),
        Model.named("lapse", courses, {**felt, "lapse": (0.3, 0.5)}),
        Model.named("noise", courses, {**felt, "decision_noise": (3.0, 10.0)}),
    ]
    table = recovery_table(list(recoveries(models, TRIALS, SECONDS, 30, seed=72_003)), [each.name for each in models])
    print(table.pivot(index="true", columns="best", values="share"))
    right = table.loc[table["true"] == table["best"], "share"]
    assert right.mean() >= 0.7
    assert right.min() > 0.5


def test_an_ideal_subject_is_as_efficient_as_the_ideal_observer():
    courses, rng = made(72_004, 160), np.random.default_rng(72_005)
    held = []
    for _ in range(SUBJECTS):
        subject = subject_of({"sigma_deg": float(rng.uniform(2.0, 8.0))})
        tables = [simulate(half, subject, 320, [2.0], rng) for half in halves(courses, rng)]
        people, ideal = (
            forced_choice(int((table["object"] == table["response"]).sum()), len(table), 4) for table in tables
        )
        found = efficiency(people, ideal)
        held.append(found.low <= 1.0 <= found.high)
    print(np.mean(held))
    assert 0.88 <= np.mean(held) <= 0.995
