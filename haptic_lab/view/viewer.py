"""Shows an exploration while it runs, from another process: what cannot be drawn in time is left out.

Shapes: J joints, C labels.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import queue
import threading
import time
from typing import Any

from rich.console import Console

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.shapes import Solid
from haptic_lab.processes import deaf
from haptic_lab.terminal import tell
from haptic_lab.view import drawer
from haptic_lab.view.listening import listen
from haptic_lab.view.moment import Pace, Setting, packed
from haptic_lab.view.options import ViewOptions
from haptic_lab.warm_up import bars
from observer import Belief

BACKLOG = 500  # moments that may wait; 20 s of them
BETWEEN = 0.04  # s, from one message to the next
FEW = 2  # surfaces that are drawn without a word


class Viewer:
    """Tells another process what there is to see.

    Attributes:
        port: of the page; 0 where there is none.
        dropped: how many moments were left out.
    """

    def __init__(self, options: ViewOptions) -> None:
        """Start the process, which opens the page.

        Args:
            options: how the exploration is shown.

        Raises:
            ValueError: where there can be no page at that port or address.
        """
        self.options, self.dropped = options, 0
        self._waiting: queue.Queue[tuple[str, tuple[Any, ...]] | None] = queue.Queue()
        listener = listen(options) if options.page else None
        self.port: int = 0 if listener is None else listener.getsockname()[1]
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=drawer.run, args=(theirs, listener, options), daemon=True)
        with deaf():
            self._process.start()
        theirs.close()
        if listener is not None:
            listener.close()
        self._sender = threading.Thread(target=self._send, daemon=True)
        self._sender.start()

    @property
    def address(self) -> str:
        """Where the page is."""
        return self.options.address(self.port)

    def begin(self, setting: Setting) -> None:
        """Begin an exploration.

        Args:
            setting: what stays as it is.
        """
        self._pace = Pace(setting.control_hz, self.options.html is not None)
        self._waiting.put(("begin", (setting,)))

    def truth(self, solid: Solid | None, label: str | None) -> None:
        """Tell what is true, which the page shows where it is asked to.

        Args:
            solid: that is explored.
            label: that is right.
        """
        self._waiting.put(("truth", (solid, label)))

    def wants(self, step: int) -> bool:
        """Tell whether a step is drawn.

        Args:
            step: from 1.

        Returns:
            Whether `show` is to be called.
        """
        return self._pace.frame(step)

    def show(
        self, step: int, belief: Belief, posterior: Array, truth: Array | None = None, whole: bool = False
    ) -> None:
        """Show what is believed at a step, if there is time.

        Args:
            step: from 1.
            belief: of it.
            posterior: (C,) probabilities of names.
            truth: (J,) rad, the true pose at the lag; None where nobody knows.
            whole: whether map and surface are drawn whatever the step.
        """
        if self._waiting.qsize() > BACKLOG and not whole:
            self.dropped += 1
            return
        self._waiting.put(("moment", packed(self._pace.take(step, belief, posterior, truth, whole))))

    def finish(self, told: str, console: Console) -> None:
        """Tell that it is over, and write the file, if one is asked for; where that cannot be, it is told.

        Args:
            told: how it ended.
            console: says what was written.

        Raises:
            KeyboardInterrupt: at a Ctrl-C meanwhile; the file is not written.
        """
        self._waiting.put(("over", (told,)))
        path = self.options.html
        if path is None:
            return
        self._waiting.put(("write", (path,)))
        try:
            wrong = self._written(path, console)
        except (EOFError, OSError):
            wrong = "the process that draws has ended"
        except KeyboardInterrupt:
            self._process.terminate()
            raise
        if wrong is None:
            console.print(f"As one page: {path}", highlight=False)
        else:
            tell("error", f"--save-html {validate.shown(path)} cannot be written: {wrong}")

    def _written(self, path: str, console: Console) -> str | None:
        """Why the file cannot be written, once it is known; surfaces that still wait are drawn first, and counted."""
        answer = self._pipe.recv()
        bar, most = bars(console), answer if isinstance(answer, int) else 0
        task = bar.add_task("surfaces", total=most)
        if most > FEW:
            still = f"{most} surfaces are still to be drawn for {path}; Ctrl-C ends without it …"
            console.print(still, highlight=False)
        with bar if most > FEW and console.is_terminal else contextlib.nullcontext():
            while isinstance(answer, int):
                bar.update(task, completed=most - answer)
                answer = self._pipe.recv()
        return None if answer is None else str(answer)

    def stay(self, console: Console) -> None:
        """Wait for Ctrl-C, if the page is to stay.

        Args:
            console: says so.
        """
        wait = console.is_terminal if self.options.wait is None else self.options.wait
        if not self.options.page or not wait:
            return
        console.print(f"The page stays open, {self.address}; Ctrl-C ends it.", highlight=False, soft_wrap=True)
        with contextlib.suppress(KeyboardInterrupt):
            while self._process.is_alive():
                time.sleep(0.2)

    def close(self) -> None:
        """Let browsers take what is left, and end the page."""
        self._waiting.put(None)
        self._sender.join(drawer.LAST)
        self._process.join(2.0 * drawer.LAST)
        if self._process.is_alive():
            self._process.terminate()
            self._sender.join(drawer.LAST)  # which now finds out that nobody reads
        self._pipe.close()

    def _send(self) -> None:
        """Sends what waits a few times a second: whenever it runs, the observer does not."""
        with contextlib.suppress(OSError):  # it has ended
            going_on = True
            while going_on:
                messages = [self._waiting.get()]
                time.sleep(BETWEEN)
                while not self._waiting.empty():
                    messages.append(self._waiting.get())
                told = [each for each in messages if each is not None]
                going_on = len(told) == len(messages)
                if told:
                    self._pipe.send(told)
            self._pipe.send([])


def opened(options: ViewOptions, console: Console) -> Viewer | None:
    """Open a view.

    Args:
        options: how an exploration is shown.
        console: says where the page is.

    Returns:
        Who is told of the exploration; None where nothing is to be shown.

    Raises:
        ValueError: where there can be no page at that port or address.
    """
    if not options.asked:
        return None
    viewer = Viewer(options)
    if options.page:
        console.print(f"View: {viewer.address}", highlight=False, soft_wrap=True)
    return viewer
