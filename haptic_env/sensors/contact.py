"""Detection of contact: a patch may miss a touch or ring falsely."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate


class ContactDetection:
    """A touched patch reports 0 with probability `miss`; an untouched one reports 1 with `false_alarm`."""

    def __init__(self, miss: float = 0.0, false_alarm: float = 0.0) -> None:
        """Check the probabilities.

        Args:
            miss: that a touched patch reports 0, at each step.
            false_alarm: that an untouched patch reports 1, at each step.

        Raises:
            ValueError: for what is none in [0, 1].
        """
        self.miss = validate.number("contact_miss", miss, 0.0, 1.0)
        self.false_alarm = validate.number("contact_false_alarm", false_alarm, 0.0, 1.0)

    def sample(self, rng: np.random.Generator, touched: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Draw what is reported.

        Args:
            rng: gives the draws.
            touched: (P,) the patches really touched.

        Returns:
            (P,) the reported contacts.
        """
        if self.miss == 0 and self.false_alarm == 0:
            return touched.copy()
        chance = rng.random(touched.shape)
        return np.where(touched, chance >= self.miss, chance < self.false_alarm)

    def log_prob(self, contacts: ArrayLike, touch_probability: ArrayLike) -> float:
        """Score what was reported.

        Args:
            contacts: (P,) as reported, 0 or 1.
            touch_probability: (P,) that each patch is touched.

        Returns:
            The log probability.

        Raises:
            ValueError: for contacts that are not 0 or 1, no probabilities, or other shapes.
        """
        touch = validate.probabilities("touch_probability", touch_probability)
        rang = validate.binary("contacts", contacts, touch.shape)
        ring = (1 - self.miss) * touch + self.false_alarm * (1 - touch)
        with np.errstate(divide="ignore"):
            return float(np.log(np.where(rang, ring, 1 - ring)).sum())
