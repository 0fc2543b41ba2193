"""What is printed of a hand, a belief and an observer is one line that a person can read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from haptic_env import hand_of, registration
from haptic_env.hand import Hand
from observer import OBSERVERS, HapticSLAM, PoseOnly, ShapePosterior

LONGEST = 120


@pytest.fixture(scope="module")
def hand() -> Hand:
    return hand_of(registration.make("HapticSLAM/TwoFinger-v0"))


def described(thing: Any) -> str:
    told = repr(thing)
    assert told.startswith(f"<{type(thing).__name__}")
    assert told.endswith(">")
    assert "\n" not in told
    assert " at 0x" not in told
    assert len(told) <= LONGEST
    return told


def test_a_hand_says_how_much_there_is_of_it(hand: Hand) -> None:
    told = described(hand)
    assert f"{hand.name}: {hand.joints} joints, {len(hand.links)} links, {len(hand.patches)} patches" in told


@pytest.mark.parametrize("name", OBSERVERS)
def test_an_observer_says_how_it_is_set(name: str, hand: Hand) -> None:
    observer = OBSERVERS[name](hand, 2.0)
    told = described(observer)
    assert f"of {hand.name}: {observer.n_particles} particles, σ = " in told
    assert f"lag {observer.lag} steps, 32 × 32 × 32 voxels of 4 mm" in told


def test_noise_that_differs_is_a_range(hand: Hand) -> None:
    told = described(HapticSLAM(hand, np.linspace(1.0, 2.0, hand.joints)))
    assert "σ = 1° to 2°" in told
    assert "σ = " in described(HapticSLAM(hand, None))


def test_an_observer_without_a_map_tells_of_none(hand: Hand) -> None:
    observer = PoseOnly(hand)
    assert described(observer) == f"<PoseOnly of {hand.name}: σ = 3°, lag {observer.lag} steps>"
    assert f"{hand.joints} joints ± " in described(observer.reset(seed=0))


def test_a_belief_says_how_sure_it_is_and_computes_nothing(hand: Hand, monkeypatch: pytest.MonkeyPatch) -> None:
    belief = HapticSLAM(hand, particles=7).reset(seed=0)
    monkeypatch.setattr(type(belief.snapshot), "value", lambda _: pytest.fail("the map was computed"))
    told = described(belief)
    assert f"{hand.joints} joints ± 0.00°, lag 0 steps, Neff 7 of 7, 32 × 32 × 32 voxels of 4 mm" in told


def test_a_posterior_tells_its_names(hand: Hand) -> None:
    told = described(ShapePosterior(hand, ["cube", "sphere"], none=0.5))
    assert "cube 25%, sphere 25%, none 50%" in told
