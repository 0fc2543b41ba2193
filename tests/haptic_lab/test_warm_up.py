"""What takes long is shown while it goes on, and nothing is where nothing does."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from haptic_env import notice
from haptic_lab.warm_up import told_on


@pytest.mark.parametrize("terminal", [True, False])
def test_nothing_is_printed_where_all_is_there(terminal: bool) -> None:
    console = Console(file=io.StringIO(), force_terminal=terminal)
    with told_on(console):
        pass
    assert console.file.getvalue() == ""  # type: ignore[attr-defined]


@pytest.mark.parametrize("terminal", [True, False])
def test_what_is_told_is_shown(terminal: bool) -> None:
    console = Console(file=io.StringIO(), force_terminal=terminal, width=120)
    with told_on(console):
        notice.tell("Measuring", 0, 2)
        notice.tell("Measuring", 1, 2)
    told = console.file.getvalue()  # type: ignore[attr-defined]
    assert "Measuring" in told
    assert "1 of 2" in told  # a bar, or a line
    with told_on(console):
        notice.tell("Measuring", 0, 1)  # bars are drawn anew
