"""A step of the pose filter as most are, compiled as one: no odd reading, no offsets, no forces that last, no
couplings.

Shapes: J joints, S numbers of the filter (`observer.pose.kalman`), P patches, B bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from observer.kinematics import Tree
from observer.pose.contact_forces import PatchForces, contact_effects
from observer.pose.gating import _sound, _usual
from observer.pose.kalman_updates import condition, process_noise, shift

NOT_USUAL, TAKEN, LOST = range(3)


class UsualHand(NamedTuple):
    """What does not change from step to step.

    Attributes:
        tree: the kinematics.
        limits: (J,) N·m, of the torques.
        forces: that act on the skin in contact.
        speeds: (P, 3) m/s, SD of the speed of such skin along each of its axes.
        many: patches in contact, beyond which a step is none of these.
    """

    tree: Tree
    limits: Array
    forces: PatchForces
    speeds: Array
    many: int


class Gates(NamedTuple):
    """Where readings and angles may lie (`observer.pose.gating`).

    Attributes:
        jump: rad, from where a joint is expected.
        low: (J,) rad, of readings.
        high: (J,) rad.
        lost_below: (J,) rad, of the angles of the filter.
        lost_above: (J,) rad.
    """

    jump: float
    low: Array
    high: Array
    lost_below: Array
    lost_above: Array


class UsualTold(NamedTuple):
    """What is told of a step.

    Attributes:
        torque: (J,) that was commanded, fractions of the limits.
        contacts: (P,) that were felt.
        before: (P,) a step earlier.
        felt: (J,) rad.
        white: (J,) rad², variance of white noise of that.
    """

    torque: Array
    contacts: NDArray[np.bool_]
    before: NDArray[np.bool_]
    felt: Array
    white: Array


@kernel()
def usual_step(gaussian, prediction, hand, noises, told, gates):
    """Move on by a step and take in what was felt, as `PoseFilter.step` does.

    Args:
        gaussian: mean (S,) and covariance (S, S), changed.
        prediction: of the forward model: (q, v) (2J,), its transition (2J, 2J), and what torques do (2J, J).
        hand: the `UsualHand`.
        noises: SD of a torque as a fraction of it, and (J,) rad/s of what the forward model leaves out of a step.
        told: the `UsualTold`.
        gates: the `Gates`.

    Returns:
        Whether the step was `NOT_USUAL`, so that nothing has changed; `TAKEN`; or taken, and the filter `LOST`. And the
        log density of what was felt.
    """
    mean, covariance = gaussian
    state, transition, gain = prediction
    torque, contacts, before, felt, white = told
    joints, patches = len(torque), len(contacts)
    if not _usual(felt, state[:joints], gates.jump, gates.low, gates.high):
        return NOT_USUAL, 0.0
    known, still = 0, 0
    for patch in range(patches):
        known += contacts[patch] or before[patch]
        still += contacts[patch]
    if still > hand.many:
        return NOT_USUAL, 0.0
    noise = process_noise(gain, torque, hand.limits, *noises)
    rows, variance = np.zeros((3 * still, 2 * joints)), np.empty(3 * still)
    if known > 0:
        index, count = np.empty(known, dtype=np.int64), 0
        for patch in range(patches):
            if contacts[patch] or before[patch]:
                index[count] = patch
                count += 1
        along = np.empty((known, 3, joints))
        contact_effects(hand.tree, state[:joints], gain, hand.forces, 0.0, index, noise, along)
        row = 0
        for f in range(known):
            if not contacts[index[f]]:
                continue
            for a in range(3):
                for j in range(joints):
                    rows[row, joints + j] = along[f, a, j]
                variance[row] = hand.speeds[index[f], a] ** 2
                row += 1
    none = np.zeros(0)
    shift(mean, covariance, state, transition, noise, joints, none, none)
    measured = rows, np.zeros(len(rows)), variance
    density = condition(mean, covariance, measured, felt, white, 2 * joints, 0)
    sound = _sound(mean, covariance, 2 * joints, gates.lost_below, gates.lost_above)
    return TAKEN if sound else LOST, density
