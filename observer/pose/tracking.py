"""What any observer tells of the source of its pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env import sensors
from observer.pose.source import PoseSource


class TracksPose:
    """An observer whose pose is tracked by a source of its own.

    Attributes:
        pose: the source, of J joints.
    """

    pose: PoseSource

    @property
    def sigma_deg(self) -> float:
        """Degrees: SD of white noise of the felt angles as the observer believes it.

        It may be set, in mid-trial too, and holds from the next step on; what is out of range raises `ValueError`.
        """
        return float(np.rad2deg(self.pose.sigma))

    @sigma_deg.setter
    def sigma_deg(self, sigma_deg: float) -> None:
        self.pose.sigma = sensors.White(sigma_deg).sigma

    @property
    def set_aside(self) -> NDArray[np.int64]:
        """(J,) how many felt angles of the trial no hand can have (`observer.pose.gating`).

        They were set aside, or taken without whole turns.
        """
        return self.pose.set_aside
