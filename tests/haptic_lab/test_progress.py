"""Progress is lines where nobody sees bars, and each line comes at once."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from haptic_lab import progress
from haptic_lab.progress import ProgressLines, tracked
from haptic_lab.sweeps.driver import progress_on

ROOT = Path(__file__).resolve().parents[2]


def piped() -> Console:
    return Console(file=io.StringIO(), width=80)


def lines(console: Console) -> list[str]:
    assert isinstance(console.file, io.StringIO)
    return [each.partition(" after ")[0] for each in console.file.getvalue().splitlines()]


@pytest.mark.parametrize(("total", "told"), [(3, 3), (10, 10), (1000, 10), (1, 1)])
def test_a_task_is_told_in_at_most_ten_lines(total: int, told: int) -> None:
    console = piped()
    with progress_on(console) as bars:
        task = bars.add_task("trials", total=total)
        for _ in range(total):
            bars.advance(task)
    assert len(lines(console)) == told
    assert lines(console)[-1] == f"trials: {total} of {total}"


def test_a_long_part_is_told_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "QUIET", -1.0)
    console = piped()
    assert list(tracked(iter("abc"), "letters", 300, console)) == ["a", "b", "c"]
    assert lines(console)[-1] == "letters: 3 of 300"


@pytest.mark.parametrize("total", [None, 0])
def test_what_has_no_end_yet_is_not_told(total: float | None) -> None:
    console = piped()
    with ProgressLines(console=console) as bars:
        bars.advance(bars.add_task("all", total=total))
        bars.update(bars.add_task("hidden", total=2, visible=False), completed=1)
    assert lines(console) == []


def test_a_terminal_has_bars() -> None:
    console = Console(file=io.StringIO(), force_terminal=True, width=80)
    with progress_on(console) as bars:
        bars.advance(bars.add_task("trials", total=1))
    assert isinstance(console.file, io.StringIO)
    assert "after" not in console.file.getvalue()
    assert "1/1" in console.file.getvalue()


def test_training_is_told_rollout_by_rollout() -> None:
    pytest.importorskip("stable_baselines3")
    from haptic_lab.learning.training import TellSteps

    console = piped()
    told = TellSteps(100, console)
    told.model = SimpleNamespace(num_timesteps=40)  # type: ignore[assignment]
    told._on_training_start()
    for told.model.num_timesteps in (45, 90, 140):
        told._on_rollout_end()
    assert lines(console) == ["steps: 50 of 100", "steps: 100 of 100"]


SPEAK = """
import sys
from haptic_lab.terminal import program
def main():
    print("first")
    sys.stdin.readline()
    return 0
program(main)
"""


def test_a_pipe_has_each_line_as_it_comes() -> None:
    told = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    command, pipe = [sys.executable, "-c", SPEAK], subprocess.PIPE
    with subprocess.Popen(command, cwd=ROOT, env=told, stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        assert process.stdout.readline() == "first\n"  # while it waits to be told to end
        process.stdin.close()
