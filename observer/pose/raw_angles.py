"""The pose that raw angles give: no filter, no dynamics.

Shapes: J joints, P patches.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.pose.angle_noise import AngleNoise, Offset


class RawAngles:
    """The felt angles taken at their word: the pose filter's interface without a filter."""

    log_evidence = 0.0

    def __init__(
        self, hand: Hand, *, sigma: float, control_hz: float, lag: int, noise: AngleNoise | None = None, **_: Any
    ) -> None:
        """`sigma` rad; `noise`: what else is wrong with the felt angles (None: nothing), of which nothing is found out;
        the rest of what a motion may be given says nothing here."""
        self.hand = hand
        self.noise = AngleNoise(hand.joints, 1.0 / control_hz) if noise is None else noise
        self._lasting = self.noise.over_time(lag + 1)
        self.sigma = sigma
        self.lag = lag
        self.set_aside = np.zeros(hand.joints, dtype=np.int64)  # all is taken at its word
        self.reset()

    def reset(self, felt: Array | None = None) -> None:
        """Start at the rest pose, whatever is `felt`."""
        self.mean = np.tile(self.hand.rest_pose, self.lag + 1)
        self.covariance = np.zeros((self.mean.size, self.mean.size))

    def step(self, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]) -> None:
        """Take over the felt `joint_angles` (J,) rad."""
        joints = self.hand.joints
        self.mean = np.concatenate([joint_angles, self.mean[:-joints]])
        white = self.noise.variance(self.sigma, self.mean, np.zeros(self.mean.size))
        self.covariance = np.diag(white) + np.kron(self._lasting, np.eye(joints))

    learns, constant = False, slice(0, 0)

    @property
    def offset(self) -> Offset:
        """What is known of the felt angles' offsets: no more than beforehand."""
        return self.noise.unknown(self.hand.joints)

    def lagged(self, steps: int) -> slice:
        """Where `mean` keeps the angles of `steps` steps ago, 0 being now."""
        return slice(steps * self.hand.joints, (steps + 1) * self.hand.joints)
