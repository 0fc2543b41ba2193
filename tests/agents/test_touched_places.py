"""What a finger remembers of where it has touched: against sums over all that it touched, and what it does about it."""

from __future__ import annotations

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from agents.gains import OF_PLACES
from agents.sb3 import read_model
from agents.touched_places import CENTRES, PLACES, TouchedPlaces
from tests.agents.test_rhythm import DECISION, hand, play, rhythm, touches

__all__ = ["hand"]
WIDTH, ENOUGH = 0.3, 0.5


def _nothing(fingers: int) -> TouchedPlaces:
    return TouchedPlaces(np.zeros((3, fingers)), np.zeros((fingers, PLACES, PLACES, PLACES)))


def test_what_is_known_is_a_sum_over_what_was_touched():
    """A kernel density, place by place; a finger that has touched nothing knows nothing."""
    rng, places, felt = np.random.default_rng(0), _nothing(2), []
    for _ in range(60):
        places = places.moved(rng.normal(size=(3, 2)), 0.5)
        seconds = 0.04 * rng.integers(0, 2, 2) * np.array([1.0, 0.0])
        felt.append((CENTRES[np.abs(places.where[:, :1] - CENTRES).argmin(axis=1)], seconds[0]))
        places = places.touching(seconds)
    assert np.abs(places.where).max() <= 1.0
    known, away = places.known(WIDTH, ENOUGH)
    way = [(places.where[:, 0] - where) / WIDTH for where, _ in felt]
    near = [seconds * np.exp(-0.5 * each @ each) for each, (_, seconds) in zip(way, felt, strict=True)]
    assert known == pytest.approx([sum(near) / (ENOUGH + sum(near)), 0.0])
    assert away[:, 0] == pytest.approx(sum(n * each for n, each in zip(near, way, strict=True)) / (ENOUGH + sum(near)))
    assert not away[:, 1].any()


def test_one_state_does_not_change_another():
    first = _nothing(1)
    later = first.moved(np.full((3, 1), 9.0), 0.5).touching(np.array([0.1]))
    assert not first.touched.any()
    assert later.where == pytest.approx(0.5)
    assert later.touched.sum() == pytest.approx(0.1)


@pytest.mark.parametrize("gain", [name for name in OF_PLACES if name.endswith(("_away", "_known"))])
def test_a_finger_does_something_about_where_it_has_touched(hand, gain):
    """Which its neighbour, that has touched nothing, does not; without a memory the gain is of no effect."""
    felt = touches(hand, "thumb_distal_tip", steps=60, since=3)
    usual = {"withdraw": 10.0, "enough": 0.1}
    change = np.abs(play(rhythm(hand, **{gain: 0.5}, **usual), felt) - play(rhythm(hand, **usual), felt)).max(axis=0)
    assert change[hand.joint_group == 0].max() > 0.02
    assert change[hand.joint_group == 1].max() == 0.0
    usual["enough"] = 0.0
    same = play(rhythm(hand, withdraw=10.0), felt)
    np.testing.assert_array_equal(play(rhythm(hand, **{gain: 0.5}, **usual), felt), same)


def test_it_goes_away_from_where_it_has_touched(hand):
    """A finger at one side moves on beyond it, where it touched on the way there."""
    still = {"sideways": 0.0, "withdraw": 10.0, "enough": 0.1, "turn_touch": 0.0}
    felt = touches(hand, "thumb_distal_tip", steps=40)
    sideways = play(rhythm(hand, across_side=0.3, across_away=0.5, **still), felt)[:, 0]
    assert not sideways.any(), "where it is, is where it touched"
    left = touches(hand, "thumb_distal_0_left", steps=40)
    alone = play(rhythm(hand, across_side=0.3, **still), left)[:, 0]
    further = play(rhythm(hand, across_side=0.3, across_away=0.5, **still), left)[:, 0]
    assert np.abs(further[10:]).min() > np.abs(alone[10:]).max()
    assert (np.sign(further[10:]) == np.sign(alone[10:])).all()


def test_a_file_keeps_what_it_remembers_with(hand, tmp_path):
    made = rhythm(hand, enough=0.2, across_away=0.5, turn_known=-0.4)
    made.write(tmp_path / "model.npz")
    again, felt = read_model(tmp_path / "model.npz"), np.random.default_rng(0).integers(0, 2, (50, len(hand.patches)))
    assert again.gains == made.gains
    assert [*again.remembers[3:]] == [(3, 2), (2, PLACES, PLACES, PLACES)]
    np.testing.assert_array_equal(play(made, felt), play(again, felt))
    slower = replace(made, seconds=2 * DECISION)
    assert not np.array_equal(play(slower, felt), play(made, felt))


def test_a_whole_hand_with_a_wrist_may_remember():
    hand = gym.make("HapticSLAM/MyoHand-v0").unwrapped.hand
    made = replace(rhythm(hand, enough=0.2, turn_known=1.0), shared=np.full((5, hand.joints), 0.01))
    felt = touches(hand, "thumb_distal_tip", steps=20)
    assert np.isfinite(play(made, felt)).all()
