"""An observer that is slower than its samples says so, and loses none."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from haptic_env import hands
from haptic_lab.live.layout import layouts
from haptic_lab.live.record import StepRecord
from haptic_lab.live.session import BEHIND, Chunk, LiveSession
from tests.haptic_lab.live.streams import moving


def test_it_is_told() -> None:
    hand, said = hands.make("two_finger"), list[str]()
    slow: Any = SimpleNamespace(hand=hand, control_hz=50.0)
    found = layouts([("joints", hand.joint_names), ("contacts", hand.patches.names)], None, hand)
    session = LiveSession(slow, slow, found, 0.02, 0, StepRecord(None, hand, 50.0), said.append)
    time, angles, contacts = moving(hand, 100)
    session.take(Chunk("joints", time, angles), 5.0)
    session.take(Chunk("contacts", time, contacts), 5.0)
    for away, tells in ((0.5 * BEHIND, 0), (1.5 * BEHIND, 1), (1.6 * BEHIND, 1)):
        session.told = SimpleNamespace(time=float(time[-1]) - away)  # type: ignore[assignment]
        session._warn(5.0, 0.0)
        assert sum("behind" in each for each in said) == tells
    assert len([*session.merger.ready(5.0), *session.merger.rest()]) == len(np.unique(time))
