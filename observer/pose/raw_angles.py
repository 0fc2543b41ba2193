"""The pose that raw angles give: no filter, no dynamics.

Shapes: J joints, P patches.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.pose.angle_noise import AngleNoise, FollowsFelt

SPEED = 1.0  # rad/s: how fast a joint that is not felt may move away from where it was


class RawAngles(FollowsFelt):
    """The felt angles taken at their word: the pose filter's interface without a filter.

    A joint that was not measured stays where it was felt last, and is there the less surely the longer that is ago.

    Attributes:
        hand: with J joints.
        noise: what is wrong with the felt angles, beside white noise.
        sigma: rad, SD of that.
        lag: T, steps that are kept.
        set_aside: (J,) zeros: all is taken at its word.
        mean: ((1 + T)·J,), `mean[lagged(k)]` being the angles (J,) rad felt k steps ago.
        covariance: of the noise, in the same order.
        log_evidence: 0.
    """

    log_evidence = 0.0

    def __init__(
        self,
        hand: Hand,
        *,
        sigma: float | Array,
        control_hz: float,
        lag: int,
        noise: AngleNoise | None = None,
        **_: Any,
    ) -> None:
        """Start at the rest pose. The rest of what a motion may be given says nothing here.

        Args:
            hand: with J joints.
            sigma: rad, SD of white noise of the felt angles.
            control_hz: Hz, steps a second.
            lag: T.
            noise: what else is wrong with them, of which nothing is found out; None: nothing.
            **_: not used.
        """
        self.hand = hand
        self.noise = AngleNoise(hand.joints, 1.0 / control_hz) if noise is None else noise
        self._lasting = self.noise.over_time(lag + 1)
        self.sigma = sigma
        self.lag, self._step = lag, 1.0 / control_hz
        self.set_aside = np.zeros(hand.joints, dtype=np.int64)  # all is taken at its word
        self.reset()

    def reset(self, felt: Array | None = None) -> None:
        """Start at the rest pose.

        Args:
            felt: not used.
        """
        self.mean = np.tile(self.hand.rest_pose, self.lag + 1)
        self._unfelt = np.zeros(self.mean.size)  # s since each angle was felt
        self.covariance = np.zeros((self.mean.size, self.mean.size))

    def step(self, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]) -> None:
        """Take over the felt angles.

        Args:
            torque: not used.
            joint_angles: (J,) rad that were felt; NaN where a joint was not measured.
            contacts: not used.
        """
        joints, missing = self.hand.joints, np.isnan(joint_angles)
        felt = np.where(missing, self.mean[:joints], joint_angles) if missing.any() else joint_angles
        unfelt = np.where(missing, self._unfelt[:joints] + self._step, 0.0)
        self.mean = np.concatenate([felt, self.mean[:-joints]])
        self._unfelt = np.concatenate([unfelt, self._unfelt[:-joints]])
        white = self.noise.variance(self.sigma, self.mean, np.zeros(self.mean.size))
        self.covariance = np.diag(white) + self._lasting
        if self._unfelt.any():
            self.covariance += np.diag((SPEED * self._unfelt) ** 2)

    def lagged(self, steps: int) -> slice:
        """Tell where `mean` keeps the angles of a step.

        Args:
            steps: how many ago, 0 being now.

        Returns:
            J numbers.
        """
        return slice(steps * self.hand.joints, (steps + 1) * self.hand.joints)
