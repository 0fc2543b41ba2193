"""Few particles are no worse than the Gaussian that they are drawn about."""

from __future__ import annotations

import numpy as np
import pytest

from observer import HapticSLAM

WRONG = np.deg2rad([2, -3, 1, 4, -2, 3, -1, 2])


@pytest.mark.parametrize("particles", [1, 2, 7])
@pytest.mark.parametrize(
    "unknown", [{"bias_deg": 3.0}, {"start_std_deg": 5.0}, {"bias_deg": 3.0, "start_std_deg": 5.0}]
)
@pytest.mark.parametrize("motion", ["forward_model", "delta_pose"])
def test_they_lie_about_the_mean_of_what_is_unknown(two_finger, particles, unknown, motion) -> None:
    slam = HapticSLAM(two_finger, 1.0, particles, lag=2, motion=motion, **unknown)
    felt, untouched = two_finger.rest_pose + WRONG, np.zeros(len(two_finger.patches))
    slam.reset(0, felt)
    for _ in range(10):
        belief = slam.step(np.zeros(two_finger.joints), felt, untouched)
    expected = slam.pose.mean[slam.pose.lagged(slam.lag)]
    np.testing.assert_allclose(belief.lagged_joint_angles, expected, atol=1e-9)
    np.testing.assert_allclose(belief.joint_offset, slam.pose.offset.mean, atol=1e-9)
