"""An observer that is slower than its samples says so once, reads all the while, and loses none."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from haptic_env import hands
from haptic_lab.live import pace, session
from haptic_lab.live.layout import layouts
from haptic_lab.live.record import StepRecord
from haptic_lab.live.session import READ, Chunk, LiveSession
from observer import HapticSLAM, ShapePosterior
from tests.haptic_lab.live.streams import Kept, moving


class Clock:
    """The machine's, which nothing but the observer and the source move on."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 50.0
        monkeypatch.setattr(session.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(pace.time, "perf_counter", lambda: self.now)


class Slow:
    """An observer and namer whose step takes a while."""

    def __init__(self, clock: Clock, hand: Any, seconds: float) -> None:
        self.clock, self.hand, self.seconds, self.control_hz, self.lag, self.labels = (
            clock,
            hand,
            seconds,
            50.0,
            10,
            ("a",),
        )

    def reset(self, seed: int | None = None, joint_angles: Any = None) -> Any:
        return np.ones(1)

    def step(self, *_: Any) -> Any:
        self.clock.now += self.seconds

    def anticipate(self) -> None:
        pass

    def update(self, belief: Any) -> Any:
        return np.ones(1)


class Sender:
    """Hands out what has come since it was asked last, and how long ago that was."""

    def __init__(self, clock: Clock, made: LiveSession, samples: int, burst: int = 1, stall: float = 0.0) -> None:
        self.clock, self.made, self.burst, self.stall = clock, made, burst, stall
        self.time, self.angles, self.contacts = moving(made.slam.hand, samples, start=clock.now)
        self.sent, self.asked, self.gaps = 0, clock.now, list[float]()

    def poll(self, stream: str, seconds: float) -> Iterator[Chunk]:
        self.gaps.append(self.clock.now - self.asked)
        self.made.stop = self.sent == len(self.time)
        if self.sent < len(self.time):
            self.clock.now = max(self.clock.now, float(self.time[min(self.sent + self.burst, len(self.time)) - 1]))
        rows = slice(self.sent, int(np.searchsorted(self.time, self.clock.now, side="right")))
        self.sent, self.asked = rows.stop, self.clock.now
        if rows.start < rows.stop:
            yield Chunk("joints", self.time[rows], self.angles[rows])
            yield Chunk("contacts", self.time[rows], self.contacts[rows])
            self.clock.now += self.stall

    def close(self) -> None:
        pass


def run(monkeypatch: pytest.MonkeyPatch, seconds: float, samples: int, burst: int = 1, stall: float = 0.0) -> tuple:
    hand, said, clock = hands.make("two_finger"), list[str](), Clock(monkeypatch)
    slow: Any = Slow(clock, hand, seconds)
    found = layouts([("joints", hand.joint_names), ("contacts", hand.patches.names)], None, hand)
    made = LiveSession(slow, slow, (*found, None), (0.02, 0.02), 0, StepRecord(None, hand, 50.0), said.append)
    sender, kept = Sender(clock, made, samples, burst, stall), Kept()
    made.run(sender, [kept])
    return made, sender, kept, said


def test_it_is_told_once_and_nothing_is_lost(monkeypatch):
    made, sender, kept, said = run(monkeypatch, 0.05, 400)
    assert len(kept.told) == 400
    assert made.merger.counts.late == made.merger.counts.joints_missing == made.merger.counts.touch_missing == 0
    assert len(said) == 1
    assert "a step takes 50.0 ms and comes every 20 ms; --control-hz 15 fits" in said[0]
    assert made.pace.most > 4.0
    assert max(sender.gaps) <= READ + 2 * 0.05  # else the streams' own buffers would run over


def test_a_burst_is_caught_up_with_in_silence(monkeypatch):
    made, _, kept, said = run(monkeypatch, 0.005, 300, burst=150)
    assert len(kept.told) == 300
    assert made.pace.most > pace.BEHIND
    assert not said


def test_what_came_while_others_had_the_processor_is_read_before_it_is_missed(monkeypatch):
    made, _, kept, _ = run(monkeypatch, 0.005, 300, stall=0.6)
    assert len(kept.told) == 300
    assert made.merger.counts.late == made.merger.counts.joints_missing == made.merger.counts.touch_missing == 0


@pytest.mark.parametrize(("seconds", "fits"), [(0.010, True), (0.018, False)])
def test_it_is_tried_before_anybody_moves(monkeypatch, seconds, fits):
    clock = Clock(monkeypatch)
    made = pace.Pace(50.0)
    slow: Any = Slow(clock, hands.make("two_finger"), seconds)
    told = made.rehearse(slow, slow)
    assert (told is None) == fits
    if told is not None:
        assert "--control-hz 41 fits" in told
        assert made.told(3.0) is None  # that was said


def test_an_observer_that_was_tried_begins_as_a_fresh_one(bits):
    hand = hands.make("two_finger")
    tried, fresh = (HapticSLAM(hand, 3.0, 5, motion="kinematic", patches_stuck=0.01) for _ in range(2))
    namer, other = (ShapePosterior(hand, none=0.1) for _ in range(2))
    pace.Pace(50.0).rehearse(tried, namer)
    _, angles, contacts = moving(hand, 15)
    for each in (tried, fresh):
        each.reset(3, angles[0])
    for each in (namer, other):
        each.reset(3)
    contacts[5:, 3] = 1.0
    for k in range(1, 15):
        one, two = (each.step(None, angles[k], contacts[k]) for each in (tried, fresh))
        assert bits(one) == bits(two)
        np.testing.assert_array_equal(namer.update(one), other.update(two))


def test_what_waits_for_a_first_pose_does_not_grow():
    hand = hands.make("two_finger")
    found = layouts([("joints", hand.joint_names), ("contacts", hand.patches.names)], None, hand)
    slow: Any = SimpleNamespace(hand=hand, control_hz=50.0)
    made = LiveSession(slow, slow, (*found, None), (0.02, 0.02), 0, StepRecord(None, hand, 50.0), lambda told: None)
    time, angles, contacts = moving(hand, 6000)
    angles[:, 0] = np.nan
    for first in range(0, 6000, 50):
        rows = slice(first, first + 50)
        made.take(Chunk("contacts", time[rows], contacts[rows]), time[first])
        made.take(Chunk("joints", time[rows], angles[rows]), time[first])
    assert max(len(made.merger._joints), len(made.merger._touch)) <= 3001
