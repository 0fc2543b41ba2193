"""What an observer makes of the contacts that it is told: which patches are touched, and which work.

Shapes: P patches, S states, W steps of a window.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.sensors import ContactDetection, Faults
from observer.contacts.hidden_markov import DEAD, STUCK, TOUCH, patch_model, smooth

SURE = 0.5  # what is more probable than this, given what came later too, is taken for a touch
POSSIBLE = 0.1  # the same for the pose of now, which a missed touch harms more than a false one


class ContactFilter:
    """Touches by what is reported of a window of steps: online for the pose, smoothed for the maps."""

    def __init__(self, detection: ContactDetection, control_hz: float, lag: int) -> None:
        """Believe in a sensor.

        Args:
            detection: of contacts, as the observer believes it.
            control_hz: Hz, of the steps.
            lag: steps that come after one before it is asked for at the latest.
        """
        self._model = patch_model(detection, control_hz)
        self._steps = lag + 1
        self.reset()

    def reset(self) -> None:
        """Start a trial: nothing is touched."""
        patches = len(self._model.prior)
        self._start = self._first = self._last = self._model.prior
        self._contacts = np.zeros((0, patches), dtype=bool)
        self._apart = np.zeros((0, patches))
        self._touched = np.zeros((0, patches))

    def step(self, contacts: NDArray[np.bool_], unmeasured: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
        """Take in a step.

        Args:
            contacts: (P,) that are reported.
            unmeasured: (P,) patches that reported nothing, which are taken to report what they did last; None: all did.

        Returns:
            (P,) which patches are touched now.
        """
        if unmeasured is not None and len(self._contacts):
            contacts = np.where(unmeasured, self._contacts[-1], contacts)
        late = len(self._contacts) == self._steps
        if late:
            self._start = self._first
        expected = self._last @ self._model.transition
        self._contacts = np.concatenate([self._contacts[late:], contacts[None]])
        self._apart = np.concatenate([self._apart[late:], expected[None, :, TOUCH]])
        self._touched = np.empty_like(self._apart)
        self._first, self._last = np.empty_like(self._start), np.empty_like(self._start)
        smooth(self._model, self._start, self._contacts, self._apart, self._touched, self._first, self._last)
        return np.asarray(self._touched[-1] > POSSIBLE)

    def touched(self, ago: int) -> NDArray[np.bool_]:
        """Tell which patches were touched, given all that was reported since.

        Args:
            ago: steps, up to the lag.

        Returns:
            (P,).
        """
        return self.probability(ago) > SURE

    def probability(self, ago: int) -> Array:
        """Tell how probable it is that each patch was touched, given all that was reported since.

        Args:
            ago: steps, up to the lag.

        Returns:
            (P,).
        """
        return self._touched[len(self._touched) - 1 - ago].copy()

    @property
    def reliability(self) -> Array:
        """(P,) probability that each patch works, given all that was reported."""
        return 1.0 - self._last[:, STUCK] - self._last[:, DEAD]

    @property
    def doubted(self) -> NDArray[np.bool_]:
        """(P,) which patches work less probably than not, so that they may be touched whatever they report."""
        return self.reliability < SURE


def believed_contacts(
    hand: Hand,
    control_hz: float,
    lag: int,
    contact_miss: float,
    contact_false_alarm: float,
    contact_confusion: float,
    patches_stuck: Faults,
    patches_dead: Faults,
) -> ContactFilter | None:
    """What an observer makes of contacts by what it is told of them.

    Args:
        hand: whose patches report.
        control_hz: Hz.
        lag: steps.
        contact_miss: as `haptic_env.sensors.ContactDetection` has it, and so are the others.
        contact_false_alarm: probability.
        contact_confusion: probability.
        patches_stuck: patches, or the probability of each.
        patches_dead: likewise.

    Returns:
        None where contacts are what is reported.

    Raises:
        ValueError: for what is out of range.
    """
    told = contact_miss, contact_false_alarm, contact_confusion
    detection = ContactDetection(*told, patches_stuck, patches_dead, hand.patches)
    if not any(told) and not detection.chances.any():
        return None
    return ContactFilter(detection, control_hz, lag)
