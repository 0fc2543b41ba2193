"""What of a trial, or of a live session, is shown.

Shapes: J joints, C labels.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from haptic_env.arrays import Array
from haptic_env.shapes import Solid
from haptic_lab.exploration.settings import OBSERVER
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.style import titles_of, with_article
from haptic_lab.trial import Trial
from haptic_lab.view.moment import Setting
from haptic_lab.view.viewer import Viewer


class TrialView:
    """Shows a trial to a viewer."""

    def __init__(self, viewer: Viewer, trial: Trial, title: str, right: Callable[[Solid], str]) -> None:
        """Begin.

        Args:
            viewer: that is told.
            trial: not begun yet.
            title: of the page.
            right: tells what an object would be called rightly.
        """
        self._viewer, self._trial, self._right = viewer, trial, right
        run = trial.observer_runs[OBSERVER]
        assert run.shape is not None
        self._run, self._namer, rate = run, run.shape, 1.0 / trial.step_seconds
        slam = run.observer
        grid, particles = slam.grid, getattr(slam, "n_particles", 1)
        seconds = trial.steps * trial.step_seconds
        viewer.begin(Setting(title, trial.hand, grid, self._namer.labels, particles, rate, seconds))

    def show(self, step: int) -> None:
        """Show where it stands, if it is time to.

        Args:
            step: of the trial, from 1.
        """
        if step == 1 and self._trial.solid is not None:
            self._viewer.truth(self._trial.solid, self._right(self._trial.solid))
        if self._viewer.wants(step):
            belief = self._run.belief
            true = self._trial.true_angles(step - belief.lag_steps)
            self._viewer.show(step, belief, self._namer.posterior, true)

    def finish(self, exploration: Exploration, trace: BeliefTrace) -> None:
        """Show how it ended.

        Args:
            exploration: what happened.
            trace: what was believed.
        """
        step = len(exploration.seconds)
        self._viewer.show(step, trace.belief, trace.posterior[-1], self._trial.true_angles(step), whole=True)


def verdict(posterior: Array, labels: tuple[str, ...]) -> str:
    """Say what an object was taken for.

    Args:
        posterior: (C,) probabilities.
        labels: (C,).

    Returns:
        A few words.
    """
    best = int(np.argmax(posterior))
    named = with_article(titles_of(labels)[labels[best]], labels[best])
    return f"over: it takes it for {named}, {posterior[best]:.0%} sure"
