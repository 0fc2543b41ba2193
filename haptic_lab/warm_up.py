"""Compiling before anything else begins, where a person can see it."""

from __future__ import annotations

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from haptic_env.hand import Hand
from observer import compiling, warm_up

WHAT = "Compiling, once for this version on this machine"


def get_ready(console: Console, hand: Hand, *, load: bool = True) -> None:
    """Compile what an exploration needs, with a bar, where that is yet to be done.

    Args:
        console: to draw on.
        hand: that will explore.
        load: as `observer.warm_up`'s: whether this process will need it itself.
    """
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed} of {task.total}")
    with Progress(*columns, TimeElapsedColumn(), console=console, transient=True) as bar:
        task = bar.add_task(WHAT, total=None, visible=False)

        def tell(done: int, total: int) -> None:
            if not console.is_terminal and not bar.tasks[0].visible:
                console.print(f"{WHAT} (some 20 s on two idle cores) …")
            bar.update(task, completed=done, total=total, visible=True)

        if load:
            warm_up(hand, tell)
        else:
            compiling.ensure(compiling.USUAL, hand, tell)
