"""The joint angles that are felt in one episode: true ones with the noise of `Proprioception`, within bounds.

Shapes: J joints.
"""

from __future__ import annotations

import numpy as np
from numba import types
from numpy.typing import NDArray

from haptic_env import readable
from haptic_env.compiled import GIVEN, inner
from haptic_env.sensors.proprioception import Angles, Lasting, Proprioception, Rng


class FeltAngles:
    """The angles that are felt in one episode: called once for each step from the reset on."""

    BOUND = 4 * np.pi  # joints stay within ±pi and noise is added

    __repr__ = readable.line

    def __init__(self, proprioception: Proprioception, rng: Rng, joints: int) -> None:
        """Draw what lasts for the episode.

        Args:
            proprioception: the noises.
            rng: gives the draws, from now on.
            joints: J.
        """
        self.proprioception = proprioception
        self._rng = rng
        self._joints = joints
        proprioception.reset(rng, joints)

    @property
    def offset(self) -> Angles:
        """(J,) rad: the errors that last, as they were at the last step."""
        lasting = (each.sampled for each in self.proprioception.noises if isinstance(each, Lasting))
        return sum(lasting, np.zeros(self._joints))

    def __call__(self, joint_angles: Angles) -> NDArray[np.float32]:
        """Draw what is felt at the next step.

        Args:
            joint_angles: (J,) rad, the true ones.

        Returns:
            (J,) rad, within ± `BOUND`.

        Raises:
            ValueError: for another shape.
        """
        if len(joint_angles) != self._joints:
            raise ValueError(f"joint_angles must be of shape ({self._joints},), got shape {np.shape(joint_angles)}")
        felt = np.empty(self._joints, np.float32)
        _clip(self.proprioception.sample(self._rng, joint_angles), self.BOUND, felt)
        return felt


@inner(types.void(GIVEN, types.float64, types.float32[::1]))
def _clip(angles: Angles, bound: float, clipped: NDArray[np.float32]) -> None:
    """Put `angles` (J,) into `clipped` (J,), none beyond ± `bound`: one call for three of NumPy."""
    for joint in range(len(angles)):
        clipped[joint] = min(max(angles[joint], -bound), bound)
