"""The process that draws: it takes moments in, keeps what the page is told of them, and serves it.

It computes nothing for the observer, and is told nothing back but that it is there.
"""

from __future__ import annotations

import importlib
import os
import queue
import socket
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from threadpoolctl import threadpool_limits

from haptic_lab.processes import end_with_parent
from haptic_lab.view.history import History
from haptic_lab.view.options import ViewOptions
from haptic_lab.view.server import PageServer

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from haptic_lab.view.encoding import Encoder
    from haptic_lab.view.moment import Moment

NICE, POLITE = 10, 15  # how much all that is drawn lets others go first, and surfaces do
RESTS = 2.0  # times as long as a surface took to draw nothing is done for the next one, where nobody waits for it
KEPT = 20  # surfaces that may wait to be drawn for a file
OFTEN = 0.1  # s, from telling how many are left to telling it again
LAST = 3.0  # s that browsers have to take what is left


def run(pipe: Connection, listener: socket.socket | None, options: ViewOptions) -> None:
    """Draw until it is told to end, or whoever tells is gone.

    Args:
        pipe: on which messages come, each a name and what belongs to it, several at once; none: it is over.
        listener: to which browsers come; None: there is no page.
        options: of the view.
    """
    end_with_parent()
    if hasattr(os, "nice"):  # not on Windows
        os.nice(NICE)  # where cores are wanted the observer has them
    history = History()
    server = None
    if listener is not None:
        server = PageServer(listener, options.token, history)
        threading.Thread(target=server.serve_forever, daemon=True).start()
    importlib.import_module("haptic_lab.view.encoding")  # takes seconds, in which the observer is made ready
    threadpool_limits(1)  # those of BLAS spin while they wait for each other, on the observer's core
    drawer = Drawer(history, 0 if options.html is None else KEPT)
    while True:
        try:
            messages = pipe.recv()
        except EOFError:  # whoever told is gone
            break
        for name, told in messages:
            if name == "write":
                while drawer.left:
                    pipe.send(drawer.left)
                    time.sleep(OFTEN)
            answer = getattr(drawer, name)(*told)
            if name == "write":
                pipe.send(answer)
        if not messages:  # it is over
            break
    history.close()
    if server is not None:
        server.finish(LAST)
    os._exit(0)  # without waiting for a surface that is still drawn, or ending the libraries that draw it


class Drawer:
    """Takes messages in; each is a method of it."""

    def __init__(self, history: History, behind: int) -> None:
        """Begin with nothing.

        Args:
            history: of the lines.
            behind: how many surfaces may wait; of more, the oldest are left out.
        """
        self.history, self._behind = history, behind
        self._encoder: Encoder | None = None
        self._waiting: queue.Queue[Moment] = queue.Queue()
        threading.Thread(target=self._draw_surfaces, daemon=True).start()

    @property
    def left(self) -> int:
        """How many surfaces are still to be drawn."""
        return self._waiting.unfinished_tasks

    def begin(self, setting: Any) -> None:
        """Begin an exploration.

        Args:
            setting: what stays as it is.
        """
        from haptic_lab.view.encoding import Encoder

        self._encoder = Encoder(setting)
        self.history.add("scene", self._encoder.scene())

    def truth(self, solid: Any, label: str | None) -> None:
        """Tell the truth.

        Args:
            solid: that is explored.
            label: that is right.
        """
        assert self._encoder is not None
        self.history.add("truth", self._encoder.truth(solid, label))

    def moment(self, *told: Any) -> None:
        """Take in a moment of the exploration.

        Args:
            *told: what `packed` makes of it.
        """
        from haptic_lab.view.moment import unpacked

        assert self._encoder is not None
        moment = unpacked(told)
        self.history.add("state", self._encoder.state(moment))
        if moment.occupancy is not None:
            self.history.add("map", self._encoder.map(moment))
        if moment.touches is not None and self._encoder.touched(moment.touches):
            self._waiting.put(moment)

    def over(self, told: str) -> None:
        """Tell that it is over.

        Args:
            told: how it ended.
        """
        from haptic_lab.view.encoding import end

        self.history.add("end", end(told))

    def write(self, path: str) -> str | None:
        """Write a page that needs no server.

        Args:
            path: of the file.

        Returns:
            Why it could not be written; None: it was.
        """
        from haptic_lab.view import page

        self._waiting.join()
        try:
            page.write(Path(path), self.history.texts())
        except OSError as error:
            return error.strerror or str(error)
        return None

    def _draw_surfaces(self) -> None:
        polite = self._behind == 0  # where nobody waits for them
        if polite and sys.platform.startswith("linux"):  # elsewhere a thread has no priority of its own
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), POLITE)
        while True:
            moment, begun = self._waiting.get(), time.monotonic()
            try:
                if self._waiting.qsize() <= self._behind:
                    assert self._encoder is not None
                    self.history.add("surface", self._encoder.surface(moment))
                    time.sleep(RESTS * (time.monotonic() - begun) if polite else 0.0)
            except Exception:  # one that cannot be drawn is left out, and those behind it are drawn
                continue
            finally:
                self._waiting.task_done()
