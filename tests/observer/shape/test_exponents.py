"""How much of what is felt counts for the name."""

from __future__ import annotations

import numpy as np
import pytest

from observer import PoseOnly, ShapePosterior
from observer.shape.exponents import JITTERED, KNOWN, TURNED, sustained

ANY_WAY = {"rotation_jitter": 180.0, "variants": 8}
RHO = 0.78  # of the error of the pose, left after a look


@pytest.mark.parametrize(
    ("keywords", "temper", "share"),
    [
        ({}, KNOWN, 1.0),
        ({"size_jitter": 0.1, "variants": 8}, JITTERED, 1.0),
        (ANY_WAY, TURNED, (1 - RHO) / (1 + RHO)),
        (ANY_WAY | {"temper": 0.3}, 0.3, 1.0),
        (ANY_WAY | {"alike": 0.0}, KNOWN, 1.0),
    ],
)
def test_only_where_solids_lie_any_way_a_touch_that_lasts_counts_less(two_finger, keywords, temper, share):
    namer = ShapePosterior(two_finger, ["cube", "sphere"], **keywords)
    assert namer.temper == temper
    assert namer.sustained == pytest.approx(share, rel=0.02)
    assert (namer.sustained == 1.0) == (share == 1.0)


def test_a_second_of_touch_counts_as_much_however_often_looks_are_taken_in():
    often, seldom = (sustained(1.0, 0.46, seconds) / seconds for seconds in (0.02, 0.06))
    assert often == pytest.approx(seldom, rel=0.05)


def test_a_namer_tells_when_it_looked(explore):
    """Each look by its step, and a look at which nothing but time has changed counts as little as it may."""
    trial = explore("cube", 60, sigma_deg=3.0)
    namer, plain = (ShapePosterior(trial.hand, ["cube", "sphere"], **ANY_WAY, **more) for more in ({}, {"temper": 1.0}))
    told = []
    for step, belief in enumerate(trial.beliefs(PoseOnly(trial.hand, 3.0)), 1):
        namer.update(belief)
        plain.update(belief)
        if belief.transition is not None and belief.lagged_contacts is not None:
            told.append(step / 50.0)  # s
    looked = told[2::3]
    for link, looks in enumerate(namer.said.looks):
        when = namer.said.when[link, :looks]
        assert (np.diff(when) > 0.0).all()
        assert set(when.tolist()) <= set(looked)
        assert when[0] == looked[0]
    assert namer.said.exponent[:, 0].tolist() == [1.0] * len(trial.hand.links)
    assert namer.said.exponent.sum() < 0.8 * plain.said.exponent.sum()
