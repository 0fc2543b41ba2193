"""Compiling before anything else begins, where a person can see it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from haptic_env import notice
from haptic_env.hand import Hand
from haptic_lab.progress import ProgressLines
from observer import compiling, warm_up

WHAT = "Compiling, once for this version on this machine"


def get_ready(console: Console, hand: Hand, *, load: bool = True) -> None:
    """Compile what an exploration needs, with a bar, where that is yet to be done.

    Args:
        console: to draw on.
        hand: that will explore.
        load: as `observer.warm_up`'s: whether this process will need it itself.
    """
    with bars(console) as bar:
        task = bar.add_task(WHAT, total=None, visible=False)

        def tell(done: int, total: int) -> None:
            if not console.is_terminal and not bar.tasks[0].visible:
                console.print(f"{WHAT} (some 20 s on two idle cores) …")
            bar.update(task, completed=done, total=total, visible=True)

        if load:
            warm_up(hand, tell)
        else:
            compiling.ensure(compiling.USUAL, hand, tell)


@contextmanager
def told_on(console: Console) -> Iterator[None]:
    """Show how far it is what takes long and is done once: distances from objects, pieces of meshes.

    Args:
        console: to draw on.

    Yields:
        Nothing.
    """
    bar, tasks = bars(console), dict[str, TaskID]()

    def tell(what: str, done: int, total: int) -> None:
        if what not in tasks:
            bar.start()  # not before: where all is there already, nothing is printed
            tasks[what] = bar.add_task(what, total=total)
            if not console.is_terminal:
                console.print(f"{what} …")
        bar.update(tasks[what], completed=done, total=total)

    try:
        with notice.heard_by(tell):
            yield
    finally:
        if tasks:
            bar.stop()


def bars(console: Console) -> Progress:
    """Make bars that count, and go once all is done.

    Args:
        console: on which they are drawn.

    Returns:
        The bars, which do not run yet.
    """
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed} of {task.total}")
    return ProgressLines(*columns, TimeElapsedColumn(), console=console, transient=True)
