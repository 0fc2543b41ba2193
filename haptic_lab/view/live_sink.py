"""Shows a live session: a sink of its beliefs."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console

from haptic_lab.live.session import Told
from haptic_lab.view.moment import Setting
from haptic_lab.view.trial_view import verdict
from haptic_lab.view.viewer import Viewer
from observer import HapticSLAM


class ViewSink:
    """Takes in what is believed at every step, and shows some of it."""

    def __init__(
        self,
        viewer: Viewer,
        slam: HapticSLAM,
        labels: tuple[str, ...],
        console: Console,
        last: Callable[[], Told | None],
    ) -> None:
        """Begin.

        Args:
            viewer: that is told.
            slam: the observer.
            labels: what the object may be.
            console: says what was written in the end.
            last: gives what was told last: it is not held here, for then each step would compute its map.
        """
        self._viewer, self._console, self._last = viewer, console, last
        self._step = -1  # the first that is told is the reset
        title = f"Live: hand {slam.hand.name.replace('_', ' ')}"
        viewer.begin(Setting(title, slam.hand, slam.grid, labels, slam.n_particles, slam.control_hz, None))

    def tell(self, told: Told) -> None:
        """Show what is believed.

        Args:
            told: of the next step.
        """
        self._step += 1
        if self._step > 0 and self._viewer.wants(self._step):
            self._viewer.show(self._step, told.belief, told.posterior)

    def close(self) -> None:
        """Show how it ended."""
        told = self._last()
        if told is None or self._step < 1:
            self._viewer.finish("over: nothing was told" if self._step < 1 else "over", self._console)
            return
        self._viewer.show(self._step, told.belief, told.posterior, whole=True)
        self._viewer.finish(verdict(told.posterior, told.labels), self._console)
