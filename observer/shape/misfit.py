"""Whether what is felt fits any candidate at all.

A posterior is a choice among candidates: contacts that fit none of them, of a sensor that is stuck say, choose one all
the same, and surely. So the evidence of the likeliest one is looked at by itself. What a patch feels against all that a
solid predicts costs log `surprise`, so that the evidence of some steps, in that unit, is how many patches no candidate
explains.
"""

from __future__ import annotations

import warnings
from collections import deque

import numpy as np

from haptic_env.arrays import Array

RECENT = 25  # steps that were taken in
TOO_MANY = 0.2  # of all patches: false alarms of 5 % come to 0.08, patches that ring by chance to 0.37 at least


class ContactsDoNotFit(UserWarning):
    """Contacts that no candidate explains, such as those of a sensor that is stuck."""


class Misfit:
    """Share of `patches` that the likeliest candidate does not explain; what it does not is taken for a `surprise`."""

    def __init__(self, patches: int, surprise: float) -> None:
        """Start a trial.

        Args:
            patches: P.
            surprise: probability of what no solid predicts.
        """
        self._most = -float(np.log(surprise)) * patches * RECENT  # nats
        self.reset()

    def reset(self) -> None:
        """Start a trial."""
        self._recent: deque[float] = deque(maxlen=RECENT)
        self._said = False

    @property
    def share(self) -> float:
        """Of all patches, over the recent steps; 0 before there are as many as that."""
        return -sum(self._recent) / self._most if len(self._recent) == RECENT and self._most > 0.0 else 0.0

    def update(self, before: Array, after: Array, temper: float) -> None:
        """Take in one step; warns, once a trial, with `ContactsDoNotFit`.

        Args:
            before: (H,) log evidence of each hypothesis before what was felt.
            after: (H,) and with it.
            temper: exponent of the evidence.
        """
        likeliest = after.argmax()
        self._recent.append((after[likeliest] - before[likeliest]) / temper)
        if not self._said and self.share > TOO_MANY:
            self._said = True
            warnings.warn(
                f"the contacts do not fit any candidate: no solid explains {100 * self.share:.0f} % of the patches "
                f"(more than {100 * TOO_MANY:.0f} %), so that the posterior says which fits least badly, not what is "
                "there",
                ContactsDoNotFit,
                stacklevel=3,
            )
