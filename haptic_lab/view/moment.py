"""What is taken of one step to be drawn, which must cost the observer next to nothing.

Shapes: J joints, P patches, C labels, (X, Y, Z) voxels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from observer import Belief
from observer.surface.touches import TouchingLink

FRAMES_PER_SECOND = 25.0  # of the exploration's own time
MAP_SECONDS, SURFACE_SECONDS = 0.2, 1.0  # between two of them


class Setting(NamedTuple):
    """What stays as it is.

    Attributes:
        title: of the page.
        hand: that is drawn.
        grid: of the map.
        labels: (C,) what the object may be.
        particles: of the observer.
        control_hz: steps a second.
        seconds: how long it will take; None: nobody knows.
    """

    title: str
    hand: Hand
    grid: Grid
    labels: tuple[str, ...]
    particles: int
    control_hz: float
    seconds: float | None


class Moment(NamedTuple):
    """What was believed at a step.

    Attributes:
        step: from 1.
        angles: (J,) rad, the smoothed pose.
        std: (J,) rad, its SD.
        covariance: (J, J) rad², of which only the correlations are used.
        contacts: (P,) which patches were touched there; None: nobody knows yet.
        root: where the hand as a whole then was; None where it does not move.
        posterior: (C,).
        n_eff: effective sample size.
        truth: (J,) rad, the true pose there; None where nobody knows.
        occupancy: (X, Y, Z); None where the map is not drawn anew.
        touches: links that have touched, and how many of their steps there are a second; None where the surface is not
            drawn anew.
    """

    step: int
    angles: Array
    std: Array
    covariance: Array
    contacts: NDArray[np.bool_] | None
    root: Pose | None
    posterior: Array
    n_eff: float
    truth: Array | None
    occupancy: NDArray[np.float32] | None
    touches: tuple[list[TouchingLink], float] | None


class Pace:
    """Which steps are drawn, and of which the map and the surface are."""

    def __init__(self, control_hz: float) -> None:
        """Choose.

        Args:
            control_hz: steps a second.
        """
        self._frame = max(1, round(control_hz / FRAMES_PER_SECOND))
        self._map, self._surface = (
            self._frame * max(1, round(seconds * control_hz / self._frame))
            for seconds in (MAP_SECONDS, SURFACE_SECONDS)
        )

    def frame(self, step: int) -> bool:
        """Tell whether a step is drawn.

        Args:
            step: from 1.

        Returns:
            Whether it is.
        """
        return step % self._frame == 0

    def take(self, step: int, belief: Belief, posterior: Array, truth: Array | None, whole: bool = False) -> Moment:
        """Take what is drawn of a step.

        Args:
            step: from 1.
            belief: of that step.
            posterior: (C,) probabilities of names.
            truth: (J,) rad, the true pose at the lag; None where nobody knows.
            whole: whether map and surface are drawn whatever the step.

        Returns:
            What belongs to it; arrays of the belief, which do not change.
        """
        log = belief.snapshot.touches
        draws_map = whole or step % self._map == 0
        draws_surface = log is not None and (whole or step % self._surface == 0)
        return Moment(
            step,
            belief.lagged_joint_angles,
            belief.lagged_joint_std,
            belief.lagged_covariance,
            belief.lagged_contacts,
            belief.lagged_root,
            np.asarray(posterior, dtype=float).copy(),
            belief.n_eff,
            None if truth is None or not np.isfinite(truth).all() else truth,
            belief.occupancy.astype(np.float32) if draws_map or draws_surface else None,
            log.some() if log is not None and draws_surface else None,
        )
