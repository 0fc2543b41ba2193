"""What is kept of an exploration, and of what an observer believed while it watched.

Shapes: T steps, J joints, P patches, C labels. Step 0 is the reset; arrays over time hold steps 1 to T.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env import readable
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from haptic_env.shapes import Solid
from observer import Belief


class SensorReading(NamedTuple):
    """What was true and what was felt at one step.

    Attributes:
        true_angles: (J,) rad.
        felt_angles: (J,) rad.
        contacts: (P,).
    """

    true_angles: Array
    felt_angles: Array
    contacts: NDArray[np.bool_]


class StepInput(NamedTuple):
    """One step as observers are told of it.

    Attributes:
        torque: (J,) fractions.
        contacts: (P,).
        root: where the hand as a whole was, if it moves.
        told: (J,) rad that each observer feels, by its name.
    """

    torque: NDArray[np.floating[Any]]
    contacts: NDArray[np.int8]
    root: Pose | None
    told: Mapping[str, Array]


@dataclass(frozen=True)
class Exploration:
    """What happened.

    Attributes:
        hand: that explored.
        solid: that was explored; None only of measured touch, where nobody says what was touched.
        seconds: (T,).
        torques: (T, J) fractions.
        felt_angles: (T, J) rad; NaN where a joint was not measured.
        true_angles: (T, J) rad; NaN where nobody knows.
        contacts: (T, P); False where a patch was not measured.
        start: the reset.
        roots: (T), where the hand as a whole was, if it moved.
        joint_offset: (T, J) rad, the true offsets of felt angles, where they are known.
        faults: (2, P) which patches are stuck, and dead, where it is known.
    """

    hand: Hand
    solid: Solid
    seconds: Array
    torques: Array
    felt_angles: Array
    true_angles: Array
    contacts: NDArray[np.bool_]
    start: SensorReading
    roots: tuple[Pose, ...] | None = None
    joint_offset: Array | None = None
    faults: NDArray[np.bool_] | None = None

    __repr__ = readable.line


@dataclass
class BeliefTrace:
    """What one observer believed.

    Attributes:
        labels: (C,), none where it was not asked to name the object.
        joint_angles: (T, J) rad, online.
        joint_std: (T, J) rad, online.
        lagged_joint_angles: (T, J) rad, of the same steps once the lag has passed.
        lagged_joint_std: (T, J) rad, of those.
        joint_offset: (T, J) rad, of felt angles, online.
        joint_offset_std: (T, J) rad, of those.
        n_eff: (T,).
        posterior: (T, C).
        belief: the last one.
        growing: (X, Y, Z) occupancy of the belief before the flush.
        patch_reliability: (T, P) probability that each patch works, online.
        touched: (T, P) which patches were touched, once the lag has passed; None where that was not told of every step.
        log_posterior: (T + 1, C) nats, from the reset on; None where nobody asked for it.
        maps: (X, Y, Z) in hindsight of every so many steps, as far as somebody asked for them.
    """

    labels: tuple[str, ...]
    joint_angles: Array
    joint_std: Array
    lagged_joint_angles: Array
    lagged_joint_std: Array
    joint_offset: Array
    joint_offset_std: Array
    n_eff: Array
    posterior: Array
    belief: Belief
    growing: Array
    patch_reliability: Array
    touched: NDArray[np.bool_] | None
    log_posterior: Array | None = None
    maps: tuple[Array, ...] = ()

    __repr__ = readable.line

    @property
    def name(self) -> str:
        """The label that the observer finds most probable in the end."""
        return self.labels[int(np.argmax(self.posterior[-1]))]
