"""Smooth motion of a hand some of whose joints follow others: only those that lead are followed for themselves."""

from __future__ import annotations

from typing import Any

import numpy as np

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.pose.coupled_joints import CoupledReadings
from observer.pose.gating import Heard
from observer.pose.lagged_moments import LaggedMoments
from observer.pose.smooth_motion import NOTHING, KinematicPose


class CoupledKinematicPose(KinematicPose):
    """`KinematicPose` of a hand that has couplings: readings of joints that move as one are one reading, and followers
    are where their roots put them."""

    def __init__(self, hand: Hand, **keywords: Any) -> None:
        """Start anywhere.

        Args:
            hand: with J joints, some of which follow others.
            **keywords: those of `KinematicPose`.
        """
        self._readings = CoupledReadings(hand.couplings)
        super().__init__(hand, **keywords)

    def reset(self, felt: Array | None = None) -> None:
        """Start a trial.

        Args:
            felt: as `KinematicPose`'s; a joint that was not felt (NaN) may be where another puts it.
        """
        if felt is not None:
            fused = self._readings.fuse(felt, ~np.isnan(felt), self.hand.rest_pose, 1.0)
            felt = np.where(fused.heard, fused.angles, felt)
        super().reset(felt)

    def _take(self, joint_angles: Array, heard: Heard | None, mixed: LaggedMoments) -> Array:
        joints, couplings = self.hand.joints, self.hand.couplings
        now, anew = self.mean[:joints], np.zeros(joints, dtype=bool)
        told, angles = np.ones(joints, dtype=bool), joint_angles
        if heard is not None:
            told, angles = np.isin(np.arange(joints), heard.joints), heard.angles
            anew = couplings.together @ heard.anew
        fused = self._readings.fuse(angles, told, now, self.sigma)
        wrong = np.where(anew & fused.heard, fused.angles - now, 0.0)
        self._moments.rows[:, :, 0, 0] += self.partners.along_squares(wrong**2)[:, None]
        along = self.partners.along(np.where(fused.heard, fused.angles, now))
        variance = np.square(self.partners.along(fused.spread)).sum(axis=1)
        variance = np.where(self.partners.all_of(fused.heard), variance, NOTHING)
        return self.partners.without(self._turn(along, variance, mixed), fused.heard & ~couplings.follows)

    def _combine(self, mixed: LaggedMoments) -> None:
        super()._combine(mixed)
        self._readings.place(self.mean, self.covariance)
