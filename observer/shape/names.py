"""What the object is called, from the likelihood of each name: the posterior, of who forgets too.

Shapes: C names, "none" the last where there is that.
"""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from observer.shape.fading import FadingNames
from observer.shape.null_model import log_shares, shares


class NamePosterior:
    """The posterior over names of one trial."""

    def __init__(
        self, log_likelihood: Array, none: float, weight: float, step_seconds: float, memory_seconds: float
    ) -> None:
        """Begin before anything was felt.

        Args:
            log_likelihood: (C,) of each.
            none: prior probability of "none", the last of them; 0: there is no such name.
            weight: exponent of the evidence against all candidates.
            step_seconds: s that pass with each belief.
            memory_seconds: s, time constant of memory; inf: it does not fade.
        """
        self._none, self._weight = none, weight
        self._fading: FadingNames | None = None
        self._forgetful = np.zeros(0)  # (C,) nats, of who forgets
        self.take(log_likelihood, 0.0)
        if memory_seconds < np.inf:
            prior = self.log_posterior
            self._fading, self._forgetful = FadingNames(prior, step_seconds, memory_seconds), prior

    def pass_by(self) -> None:
        """Let a step go by at which nothing was taken in."""
        if self._fading is not None:
            self._forgetful = self._fading.take(log_shares(*self._told))

    def take(self, log_likelihood: Array, unfit: float) -> None:
        """Take in a step.

        Args:
            log_likelihood: (C,) of each name, of all that was felt so far.
            unfit: probability of "none" that is known otherwise.
        """
        none = (log_likelihood[-1], self._none, self._weight, unfit) if self._none else ()
        self._told = (log_likelihood[:-1] if none else log_likelihood, *none)
        self._posterior = shares(*self._told)
        self.pass_by()

    @property
    def log_posterior(self) -> Array:
        """(C,) nats."""
        return log_shares(*self._told) if self._fading is None else self._forgetful.copy()

    @property
    def posterior(self) -> Array:
        """(C,) probabilities."""
        return self._posterior.copy() if self._fading is None else np.exp(self._forgetful)
