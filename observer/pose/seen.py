"""What of the pose filter's Gaussian is told at a step.

Shapes: J joints, S numbers of the filter (`observer.pose.kalman`), P patches. Angles in radians.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import kernel


class Seen(NamedTuple):
    """What is known of two steps.

    Attributes:
        angles: (J,) rad, the mean of now.
        std: (J,) rad, its SD.
        lagged: (J,) rad, the mean of a step before.
        lagged_std: (J,) rad, its SD.
        lagged_covariance: (J, J) rad².
    """

    angles: Array
    std: Array
    lagged: Array
    lagged_std: Array
    lagged_covariance: Array


class LaggedPose(NamedTuple):
    """A pose that is told of, and what was felt there.

    Attributes:
        mean: (J,) rad.
        covariance: (J, J) rad².
        contacts: (P,) which patches were touched.
        unmeasured: (P,) patches whose contact was not measured; None: all were.
    """

    mean: Array
    covariance: Array
    contacts: NDArray[np.bool_]
    unmeasured: NDArray[np.bool_] | None


@kernel()
def seen_of(mean, covariance, lagged, joints):
    """Read two steps off a Gaussian.

    Args:
        mean: (S,), the present being its first J numbers.
        covariance: (S, S).
        lagged: index of the first of the J numbers of the other step.
        joints: J.

    Returns:
        What `Seen` has.
    """
    now, std = np.empty(joints), np.empty(joints)
    then, then_std, block = np.empty(joints), np.empty(joints), np.empty((joints, joints))
    for i in range(joints):
        now[i], std[i] = mean[i], np.sqrt(covariance[i, i])
        then[i], then_std[i] = mean[lagged + i], np.sqrt(covariance[lagged + i, lagged + i])
        for j in range(joints):
            block[i, j] = covariance[lagged + i, lagged + j]
    return now, std, then, then_std, block
