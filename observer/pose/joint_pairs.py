"""Which joints move together, found out as they move.

Shapes: J joints, C = J² directions, S numbers of a direction's state, H = J hypotheses of each joint.

A joint moves alone or with one other, its partner, in the same sense or against it: then their sum and their
difference, (q_i ± q_j) / √2, move each for itself, one more than the other. That is a rotation of the two, so the noise
of the felt angles is the same along all of these directions, and each can be filtered like a joint: all joints, the
sums of all pairs, the differences of all pairs. What a joint does is the mixture of what its partners say, weighted by
the evidence for each pair against its two joints alone.

The evidence counts with an exponent: partners are not known to keep together, and no hand moves in pairs only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.moved import renamed
from observer.pose.lagged_moments import HALF, LaggedMoments, over_partners

__getattr__ = renamed(__name__, {"Partners": "JointPairs"})


class JointPairs:
    """The directions, the evidence for each, and what they tell of the joints.

    Attributes:
        joints: J.
        temper: exponent of the evidence.
        count: C.
    """

    def __init__(self, joints: int, together: float, temper: float, alone: NDArray[np.bool_] | None = None) -> None:
        """Start with no evidence.

        Args:
            joints: J.
            together: probability beforehand that a joint has a partner.
            temper: exponent of the evidence.
            alone: (J,) joints that have no partner; None: there are none.
        """
        self.joints, self.temper = joints, temper
        some = together > 0.0 and joints > 1
        self._first, self._second = np.triu_indices(joints if some else 1, 1)
        alone = np.zeros(joints, dtype=bool) if alone is None else alone
        others = joints - 1 - int(alone.sum())
        self._prior = np.full((joints, joints), np.log(together / others) if some and others > 0 else -np.inf)
        self._prior[alone] = self._prior[:, alone] = -np.inf
        np.fill_diagonal(self._prior, np.log1p(-together) if some else 0.0)
        self.count = joints + 2 * len(self._first)
        self.reset()

    def reset(self) -> None:
        """Forget who moves with whom."""
        self._advantage = np.zeros(len(self._first))

    def along(self, angles: Array) -> Array:
        """Measure angles along every direction.

        Args:
            angles: (J,) rad.

        Returns:
            (C,) rad.
        """
        one, other = angles[self._first], angles[self._second]
        return np.concatenate([angles, HALF * (one + other), HALF * (one - other)])

    def along_squares(self, squares: Array) -> Array:
        """Measure independent variances along every direction.

        Args:
            squares: (J,) rad².

        Returns:
            (C,) rad².
        """
        both = 0.5 * (squares[self._first] + squares[self._second])
        return np.concatenate([squares, both, both])

    def all_of(self, joints: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Find the directions that some of the joints have to themselves.

        Args:
            joints: (J,) which.

        Returns:
            (C,).
        """
        both = joints[self._first] & joints[self._second]
        return np.concatenate([joints, both, both])

    def without(self, log_density: Array, heard: NDArray[np.bool_]) -> Array:
        """Let a pair of which a joint tells nothing say as much as its two joints alone.

        Args:
            log_density: (C,) of what was felt.
            heard: (J,) the joints that tell of anything.

        Returns:
            (C,).
        """
        alone = np.where(heard, log_density[: self.joints], 0.0)
        apart = 0.5 * (alone[self._first] + alone[self._second])
        told = np.concatenate([alone, apart, apart])
        return np.where(self.all_of(heard), log_density, told)

    def learn(self, log_density: Array) -> None:
        """Take in a step.

        Args:
            log_density: (C,) of what was felt along each direction, given what was felt before.
        """
        alone, pairs = log_density[: self.joints], log_density[self.joints :].reshape(2, -1)
        self._advantage += pairs.sum(axis=0) - alone[self._first] - alone[self._second]

    def weights(self) -> Array:
        """Tell how probable each joint's partners are.

        Returns:
            (J, H), by row; the joint itself stands for none.
        """
        log_weight = self._prior.copy()
        log_weight[self._first, self._second] += self.temper * self._advantage
        log_weight[self._second, self._first] += self.temper * self._advantage
        log_weight -= log_weight.max(axis=1, keepdims=True)
        weight = np.exp(log_weight)
        return np.asarray(weight / weight.sum(axis=1, keepdims=True))

    def of_joints(self, moments: LaggedMoments) -> LaggedMoments:
        """Mix what the directions say of each joint.

        Args:
            moments: of the directions' states, C.

        Returns:
            Those of the joints' states, J.
        """
        if not len(self._first):
            return moments
        _, lag = moments.bands.shape[1:]
        mixed = LaggedMoments.zero((self.joints,), lag, moments.bands.shape[1] - 1)
        over_partners(self.weights(), moments, mixed)
        return mixed
