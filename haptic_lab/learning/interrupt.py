"""Ctrl-C, kept where it was lost: some libraries swallow it while they are imported, or in a callback of C.

And what a run says that it has stopped.
"""

from __future__ import annotations

import signal
from types import TracebackType

from rich.console import Console


class InterruptGuard:
    """Within it Ctrl-C raises `KeyboardInterrupt` as ever, and `check` raises it once more where it came to nothing.

    What fails after a Ctrl-C, as an import that was cut short does in its own way, ends as that.
    """

    def __init__(self) -> None:
        self.asked = False

    def __enter__(self) -> InterruptGuard:
        self._usual = signal.signal(signal.SIGINT, self._ask)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        signal.signal(signal.SIGINT, self._usual)
        if self.asked and isinstance(error, Exception):
            raise KeyboardInterrupt from error

    def _ask(self, *_: object) -> None:
        self.asked = True
        raise KeyboardInterrupt

    def check(self) -> None:
        """Raise what may have been swallowed.

        Raises:
            KeyboardInterrupt: if Ctrl-C was pressed.
        """
        if self.asked:
            raise KeyboardInterrupt


def stopped(console: Console) -> int:
    """Say that a run was stopped by Ctrl-C.

    Args:
        console: to say it.

    Returns:
        Exit code.
    """
    console.print("Stopped; the same command goes on from here.")
    return 130
