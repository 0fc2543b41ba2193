"""What the whole hand that ships owes to touch: the same rhythm, shown no contacts, or those of other episodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.instead import Instead
from agents.rhythm import Rhythm
from agents.sb3 import WholeHand, read_model
from haptic_lab.learning import presets
from haptic_lab.learning.candidates import Judge, Outcome
from tests.haptic_lab.test_reflexes_long import RESAMPLED, Numb, Watched

WORLDS, FIRST_SEED, OTHERS = 32, 77_720, 900_000
CONDITIONS = ("as it is", "feels nothing", "feels other episodes", "as the search began")


@pytest.mark.statistical
@pytest.mark.timeout(1800)
def test_what_a_whole_hand_that_feels_nothing_or_something_else_is_worth() -> None:
    """Seconds in doubt of 4, and to the decision, in the same worlds, with the pose filter that evaluation has."""
    preset = presets.read("whole_hand")
    model = read_model(WholeHand.shipped)
    assert isinstance(model, Rhythm)
    known, patches = dict(vars(model)), len(model.observation_space.low)
    columns = np.arange(patches)
    nothing = Numb(**known | {"instead": Instead(columns, np.zeros((1, 1, patches), np.float32))})
    began = replace(model, gains=preset.rhythm, shared=None)
    judge = Judge(replace(preset.world, filtered=True, sigma_deg=(2.0, 6.0)), 1)
    rows: list[list[Outcome]] = []
    for world in range(WORLDS):
        other = Watched(**known)
        judge.judge([(other, OTHERS + world + 1)], held_out=True)  # about another object
        elsewhere = Numb(**known | {"instead": Instead(columns, np.array([other.__dict__["kept"]]))})
        rows.append(judge.judge([(each, FIRST_SEED + world) for each in (model, nothing, elsewhere, began)], True))
    doubts, rng = np.array([[each.doubt for each in row] for row in rows]), np.random.default_rng(0)
    drawn = doubts[rng.integers(0, WORLDS, (RESAMPLED, WORLDS))].mean(axis=1)
    lost = {}
    for index, name in enumerate(CONDITIONS):
        low, high = np.percentile(drawn[:, index], (2.5, 97.5))
        lost[name] = np.percentile(drawn[:, index] - drawn[:, 0], (2.5, 97.5))
        seconds = [each[index].decisions * preset.world.hold / 50.0 if each[index].right else np.inf for each in rows]
        print(
            f"{name}: in doubt {doubts[:, index].mean():.2f} s [{low:.2f}, {high:.2f}], longer by "
            f"{(doubts[:, index] - doubts[:, 0]).mean():.2f} {lost[name].round(2)}; median {np.median(seconds):.2f} s"
        )
    assert lost["as the search began"][0] > 0.0
