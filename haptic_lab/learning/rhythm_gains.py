"""The gains of a rhythm as weights that are searched: each in its unit, from where the preset begins.

Shapes: K weights, J joints, of which W move several fingers, as those of a wrist.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from agents.finger_kinematics import FingerKinematics
from agents.gains import searched
from agents.rhythm import SHARED, Rhythm, rhythm_for
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
            begin: all of `agents.gains.GAINS`, which weights of 0 are; those of places are searched where it remembers
                any.
            seconds: from one decision to the next.
            told: how it is trained (`agents.network.Network`).
        """
        self._shared = np.flatnonzero(FingerKinematics(hand).moves.sum(axis=0) > 1)
        self._searched = searched(begin)
        self.size = len(self._searched) + len(SHARED) * len(self._shared)
        self._hand, self._space, self._begin = hand, features.space, dict(begin)
        self._seconds, self._told = seconds, dict(told)

    def candidate(self, weights: ArrayLike) -> Rhythm:
        """Make the rhythm of some weights.

        Args:
            weights: (K,): the gains, in their units, and 5 W fractions of torque limits, as `Rhythm.shared` has them.

        Returns:
            The rhythm; gains that would be out of their range are at its end.
        """
        own, others = np.split(np.asarray(weights, np.float64), [len(self._searched)])
        gains = dict(self._begin)
        gains |= {
            name: float(np.clip(self._begin[name] + gain.unit * weight, gain.low, gain.high))
            for (name, gain), weight in zip(self._searched.items(), own.tolist(), strict=True)
        }
        shared = None
        if len(self._shared):
            shared = np.zeros((len(SHARED), self._hand.joints))
            shared[:, self._shared] = others.reshape(len(SHARED), -1)
        return rhythm_for(self._hand, self._space, gains, self._seconds, self._told, shared)
