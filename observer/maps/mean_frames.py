"""Where the links of a hand are at the mean pose, and how surely.

Shapes: N particles, J joints, L links, P patches, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import kernel
from haptic_env.moved import renamed
from observer.kinematics import body_frames, place_spread
from observer.maps.evidence import reach_of

__getattr__ = renamed(__name__, {"Stance": "MeanFrames"})


class MeanFrames(NamedTuple):
    """How the hand stands: at the angles `pose` (J,), with the frames of its bodies at `position` (B, 3) m and
    `rotation` (B, 3, 3)."""

    pose: NDArray[np.float64]
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]


@kernel()
def stand(tree, body, evidence, caution, pose, covariance):
    """The `MeanFrames` of the hand at the mean `pose` (J,), and the `LinkEvidence` of its links, `caution` times as far
    as the `covariance` (J, J) rad² of the pose leaves their places unknown."""
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, pose, position, rotation)
    place = place_spread(tree, body.length, pose, covariance, position, rotation)
    for link in range(len(place)):
        place[link] *= caution
    return MeanFrames(pose, position, rotation), reach_of(body, evidence, place)
