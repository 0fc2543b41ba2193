"""Compiling before anything else begins, where a person can see it."""

from __future__ import annotations

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

import observer
from haptic_env.hand import Hand


def get_ready(console: Console, hand: Hand) -> None:
    """Compile what an exploration with `hand` needs (`observer.warm_up`); with a bar, where that is yet to be done."""
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed} of {task.total}")
    with Progress(*columns, TimeElapsedColumn(), console=console, transient=True) as bar:
        task = bar.add_task("Compiling, once for this version on this machine", total=None, visible=False)

        def tell(done: int, total: int) -> None:
            if not console.is_terminal and not bar.tasks[0].visible:
                console.print("Compiling, once for this version on this machine (some 20 s on two idle cores) …")
            bar.update(task, completed=done, total=total, visible=True)

        observer.warm_up(hand, tell)
