"""What the reflexes that ship owe to touch: the same rhythm, shown no contacts, or those of other episodes.

And what they owe to what they remember: the same rhythm without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.gains import OF_REFLEXES, gains_of
from agents.instead import Instead
from agents.rhythm import Rhythm
from agents.sb3 import Reflexes, read_model
from haptic_lab.learning import presets
from haptic_lab.learning.covering import Covering

WORLDS, FIRST_SEED, OTHERS = 60, 79_424, 77_160
RESAMPLED = 2000


class Numb(Rhythm):
    """Feels what it is shown instead: (T, P), decision by decision."""

    def predict(self, observation, memory, began, deterministic, rng):
        self.__dict__["decision"] = 0 if began else self.__dict__["decision"] + 1
        return super().predict(self.instead.put(observation, 0, self.decision), memory, began, deterministic, rng)


class Watched(Rhythm):
    """Keeps what it feels."""

    def predict(self, observation, memory, began, deterministic, rng):
        kept = self.__dict__.setdefault("kept", [])
        kept.append(np.array(observation, np.float32))
        return super().predict(observation, memory, began, deterministic, rng)


@pytest.mark.statistical
@pytest.mark.timeout(1800)
def test_a_rhythm_that_feels_nothing_or_something_else_touches_less() -> None:
    """Shares of the surface touched in 20 s, in the same worlds, with intervals by bootstrap over them."""
    model = read_model(Reflexes.shipped)
    assert isinstance(model, Rhythm)
    covering = Covering(presets.read("reflexes").world, held_out=True)
    known = dict(vars(model))
    patches = len(model.observation_space.low)
    columns = np.arange(patches)
    nothing = Numb(**known | {"instead": Instead(columns, np.zeros((1, 1, patches), np.float32))})
    forgetful = replace(model, gains=model.gains | {"enough": 0.0})
    rhythm = presets.read("reflexes").rhythm
    begin = replace(model, gains=rhythm)
    before = replace(model, gains=gains_of({name: rhythm[name] for name in OF_REFLEXES}))
    rows = []
    for world in range(WORLDS):
        other = Watched(**known)
        covering.play(other, OTHERS + world + 7)
        elsewhere = Numb(**known | {"instead": Instead(columns, np.array([other.__dict__["kept"]]))})
        beside = (model, nothing, elsewhere, forgetful, begin, before)
        rows.append([covering.play(each, FIRST_SEED + world)[0] for each in beside])
    shares, rng = np.array(rows), np.random.default_rng(0)
    drawn = shares[rng.integers(0, WORLDS, (RESAMPLED, WORLDS))].mean(axis=1)
    lost = {}
    names = ("as it is", "feels nothing", "feels other episodes", "remembers nothing")
    for index, name in enumerate((*names, "as the search began", "as the search began, and remembers nothing")):
        low, high = np.percentile(drawn[:, index], (2.5, 97.5))
        lost[name] = np.percentile(drawn[:, 0] - drawn[:, index], (2.5, 97.5))
        gap = (shares[:, 0] - shares[:, index]).mean()
        print(f"{name}: {shares[:, index].mean():.1%} [{low:.1%}, {high:.1%}], less by {gap:.1%} {lost[name].round(3)}")
    assert lost["feels nothing"][0] > 0.0
    assert lost["feels other episodes"][0] > 0.0
