"""How far something is: bars on a terminal; in a pipe or a file lines, which come while it runs."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import Progress, ProgressColumn, TaskID

T = TypeVar("T")
PARTS = 10  # of a task, after each of which there is a line
QUIET = 60.0  # s after which there is one anyway


class ProgressLines(Progress):
    """`rich.progress.Progress`, which away from a terminal shows nothing until the end, with lines in place of bars."""

    def __init__(self, *columns: ProgressColumn, console: Console, transient: bool = False) -> None:
        """Show nothing yet.

        Args:
            *columns: of the bars.
            console: to draw on.
            transient: whether the bars go once all is done.
        """
        super().__init__(*columns, console=console, transient=transient, disable=not console.is_terminal)
        self._said: dict[TaskID, tuple[int, float]] = {}  # of each task which part was told, and when

    def update(self, task_id: TaskID, **changes: Any) -> None:
        """As `Progress.update`.

        Args:
            task_id: of the task.
            **changes: of it.
        """
        super().update(task_id, **changes)
        self._say(task_id)

    def advance(self, task_id: TaskID, advance: float = 1) -> None:
        """As `Progress.advance`.

        Args:
            task_id: of the task.
            advance: how much more of it is done.
        """
        super().advance(task_id, advance)
        self._say(task_id)

    def _say(self, task_id: TaskID) -> None:
        task = self._tasks[task_id]
        if self.console.is_terminal or not task.visible or not task.total or not task.completed:
            return
        now, part = time.monotonic(), int(PARTS * task.completed / task.total)
        told, when = self._said.setdefault(task_id, (0, now))
        if part > told or now - when > QUIET:
            self._said[task_id] = part, now
            line = f"{task.description}: {task.completed:g} of {task.total:g} after {task.elapsed or 0.0:.0f} s"
            self.console.print(line, highlight=False, soft_wrap=True)


def tracked(what: Iterable[T], description: str, total: int, console: Console) -> Iterable[T]:
    """Go through something, and tell how far it is.

    Args:
        what: to go through.
        description: of what is done.
        total: how much there is.
        console: to draw on.

    Yields:
        Each of it.
    """
    with ProgressLines(*Progress.get_default_columns(), console=console, transient=True) as progress:
        yield from progress.track(what, total=total, description=description)
