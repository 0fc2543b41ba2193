"""Shows a live session: a sink of its beliefs."""

from __future__ import annotations

from rich.console import Console

from haptic_lab.live.session import Told
from haptic_lab.view.moment import Setting
from haptic_lab.view.trial_view import verdict
from haptic_lab.view.viewer import Viewer
from observer import HapticSLAM


class ViewSink:
    """Takes in what is believed at every step, and shows some of it."""

    def __init__(self, viewer: Viewer, slam: HapticSLAM, labels: tuple[str, ...], console: Console) -> None:
        """Begin.

        Args:
            viewer: that is told.
            slam: the observer.
            labels: what the object may be.
            console: says what was written in the end.
        """
        self._viewer, self._console = viewer, console
        self._step = -1  # the first that is told is the reset
        self._told: Told | None = None
        title = f"Live: hand {slam.hand.name.replace('_', ' ')}"
        viewer.begin(Setting(title, slam.hand, slam.grid, labels, slam.n_particles, slam.control_hz, None))

    def tell(self, told: Told) -> None:
        """Show what is believed.

        Args:
            told: of the next step.
        """
        self._step += 1
        if self._step == 0:
            return
        self._told = None  # its map would be computed just before it changes, though nobody asked for it
        if self._viewer.wants(self._step):
            self._viewer.show(self._step, told.belief, told.posterior)
        self._told = told

    def close(self) -> None:
        """Show how it ended."""
        if self._told is None:
            self._viewer.finish("over: nothing was told", self._console)
            return
        self._viewer.show(self._step, self._told.belief, self._told.posterior, whole=True)
        self._viewer.finish(verdict(self._told.posterior, self._told.labels), self._console)
