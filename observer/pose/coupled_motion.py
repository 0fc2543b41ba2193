"""Smooth motion of a hand some of whose joints follow others: only those that lead are followed for themselves."""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from observer.pose.coupled_joints import fuse, place
from observer.pose.gating import Heard
from observer.pose.lagged_moments import LaggedMoments
from observer.pose.smooth_motion import KinematicPose


class CoupledKinematicPose(KinematicPose):
    """`KinematicPose` of a hand that has couplings: readings of joints that move as one are one reading, and followers
    are where their roots put them."""

    def reset(self, felt: Array | None = None) -> None:
        """Start a trial.

        Args:
            felt: as `KinematicPose`'s; a joint that was not felt (NaN) may be where another puts it.
        """
        if felt is not None:
            fused = fuse(self.hand.couplings, felt, ~np.isnan(felt), self.hand.rest_pose, 1.0)
            felt = np.where(fused.heard, fused.angles, felt)
        super().reset(felt)

    def _take(self, joint_angles: Array, heard: Heard | None) -> tuple[Array, LaggedMoments]:
        joints, couplings = self.hand.joints, self.hand.couplings
        told, angles, anew = np.ones(joints, dtype=bool), joint_angles, np.zeros(joints, dtype=bool)
        if heard is not None:
            told, angles = np.isin(np.arange(joints), heard.joints), heard.angles
            anew = couplings.together @ heard.anew
        fused = fuse(couplings, angles, told, self.mean[:joints], self.sigma)
        variance = np.square(self.partners.along(fused.spread)).sum(axis=1)
        known = Heard(fused.angles, np.flatnonzero(fused.heard), anew & fused.heard)
        log_density, moments = self._take_some(known, variance)
        return self.partners.without(log_density, ~couplings.follows), moments

    def _combine(self, moments: LaggedMoments) -> None:
        super()._combine(moments)
        place(self.hand.couplings, self.mean, self.covariance)
