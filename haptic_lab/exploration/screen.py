"""The terminal while the hand explores: time, effective sample size and the posterior of the name."""

from __future__ import annotations

import time

from rich.bar import Bar
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from haptic_lab.exploration.settings import OBSERVER
from haptic_lab.style import colours_of, titles_of
from haptic_lab.trial import Trial


class Screen:
    """What is seen while the hand explores: a live panel on a terminal, else a line a second."""

    def __init__(self, console: Console, trial: Trial) -> None:
        """Show nothing yet.

        Args:
            console: to draw on.
            trial: that is shown.
        """
        self.console, self.trial = console, trial
        self.observer_run = trial.observer_runs[OBSERVER]
        self.titles = titles_of(self.observer_run.posterior)
        self.live = Live(console=console, refresh_per_second=8, transient=True) if console.is_terminal else None
        self._shown = time.monotonic()

    def __enter__(self) -> Screen:
        if self.live is not None:
            self.live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.live is not None:
            self.live.stop()

    def show(self, step: int) -> None:
        """Tell where the exploration stands.

        Args:
            step: of the trial, from 1.
        """
        seconds, each = step * self.trial.step_seconds, round(1.0 / self.trial.step_seconds)
        if self.live is not None and time.monotonic() - self._shown > 0.1:
            self._shown = time.monotonic()
            self.live.update(self._panel(seconds, step))
        elif self.live is None and step % each == 0:
            names = "  ".join(f"{self.titles[name]} {p:4.0%}" for name, p in self.observer_run.posterior.items())
            line = f"{seconds:5.1f} s  Neff {self.observer_run.belief.n_eff:6.1f}  {names}"
            self.console.print(line, highlight=False, soft_wrap=True)

    def _panel(self, seconds: float, step: int) -> Group:
        count = len(self.observer_run.belief.weights)
        head = Table.grid(padding=(0, 2))
        head.add_row(
            ProgressBar(self.trial.steps, step, width=30),
            f"{seconds:4.1f} s of {self.trial.steps * self.trial.step_seconds:g} s",
            f"Neff {self.observer_run.belief.n_eff:.0f} of {count}",
        )
        bars = Table.grid(padding=(0, 2))
        colours = colours_of(self.observer_run.posterior)
        for name, p in self.observer_run.posterior.items():
            bars.add_row(self.titles[name], Bar(1.0, 0.0, p, width=30, color=colours[name]), f"{p:4.0%}")
        return Group(head, bars)
