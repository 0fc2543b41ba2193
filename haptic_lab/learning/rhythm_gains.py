"""The gains of a rhythm as weights that are searched: each in its unit, from where the preset begins.

Shapes: K gains.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from agents.rhythm import GAINS, Rhythm, rhythm_for
from haptic_env.hand import Hand
from observer.wrappers.belief_observation import BeliefFeatures


class RhythmGains:
    """A rhythm with reflexes, of so few numbers that they can be searched.

    Attributes:
        size: K.
    """

    def __init__(
        self,
        hand: Hand,
        features: BeliefFeatures,
        begin: Mapping[str, float],
        seconds: float,
        told: Mapping[str, Any],
    ) -> None:
        """Keep where the search begins.

        Args:
            hand: that explores.
            features: of the observation, the entry "contacts".
            begin: all of `agents.rhythm.GAINS`, which weights of 0 are.
            seconds: from one decision to the next.
            told: how it is trained (`agents.network.Network`).
        """
        self.size = len(GAINS)
        self._hand, self._space, self._begin = hand, features.space, dict(begin)
        self._seconds, self._told = seconds, dict(told)

    def candidate(self, weights: ArrayLike) -> Rhythm:
        """Make the rhythm of some weights.

        Args:
            weights: (K,), in units of the gains.

        Returns:
            The rhythm; gains that would be out of their range are at its end.
        """
        gains = {
            name: float(np.clip(self._begin[name] + gain.unit * weight, gain.low, gain.high))
            for (name, gain), weight in zip(GAINS.items(), np.asarray(weights, np.float64).tolist(), strict=True)
        }
        return rhythm_for(self._hand, self._space, gains, self._seconds, self._told)
