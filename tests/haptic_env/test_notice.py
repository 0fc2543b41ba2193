"""What takes long is told to whoever shows it, or logged in a line."""

from __future__ import annotations

import logging

import pytest

from haptic_env import notice


def test_a_listener_is_told_and_nothing_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    heard: list[tuple[str, int, int]] = []
    with notice.heard_by(lambda *told: heard.append(told)):
        notice.tell("Measuring", 0, 2)
        notice.tell("Measuring", 2, 2)
    assert heard == [("Measuring", 0, 2), ("Measuring", 2, 2)]
    assert not caplog.records


def test_without_a_listener_a_line_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "haptic_slam"):
        for done in range(3):
            notice.tell("Measuring", done, 2)
    assert [record.getMessage() for record in caplog.records] == ["Measuring: 2"]
