"""What observers of the pose know of joints that follow others (`haptic_env.coupling`): where one is, the other is.

Shapes: J joints, F followers, S numbers of a joint's state, C directions (`observer.pose.joint_pairs`).

Where torques are known, the forward model couples the joints, and what a step adds to what is uncertain is uncertain of
roots alone (`keep_together`).
Where motion is smooth, readings of joints that move as one are one reading of their root, as exact as all of them
(`fuse`), and followers are where that puts them (`place`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.coupling import Couplings

SLACK = 1e-3  # rad, SD by which a coupling gives
LEAST = 1e-3  # of a root's way: a joint that hardly moves with it tells nothing of it


def keep_together(couplings: Couplings, angles: Array, noise: Array) -> None:
    """Let nothing that a step adds tear joints apart that move as one.

    Args:
        couplings: of J joints.
        angles: (J,) rad, as predicted.
        noise: (D, D) covariance of what the step adds to the state, (q, v) first; changed.
    """
    along, state = couplings.along(angles), slice(0, 2 * couplings.joints)
    noise[state] = along @ noise[state]
    noise[:, state] = noise[:, state] @ along.T
    followers = np.flatnonzero(couplings.follows)
    noise[followers, followers] += SLACK**2


class Fused(NamedTuple):
    """Readings of a step, of joints that move as one put together.

    Attributes:
        angles: (J,) rad.
        heard: (J,) of which joints there are any.
        spread: (J, J) rad: their errors are this times independent ones of unit variance.
    """

    angles: Array
    heard: NDArray[np.bool_]
    spread: Array


def fuse(couplings: Couplings, felt: Array, heard: NDArray[np.bool_], expected: Array, sigma: float | Array) -> Fused:
    """Put readings of joints that move as one together.

    Args:
        couplings: of J joints.
        felt: (J,) rad; whatever, where they are not heard.
        heard: (J,) which are.
        expected: (J,) rad, about which couplings are lines.
        sigma: rad, SD of a reading.

    Returns:
        One reading of each joint.
    """
    about = couplings.follow(expected)
    slopes = couplings.slopes(about)
    told = heard & (np.abs(slopes) > LEAST)
    weight, way = np.zeros(couplings.joints), np.zeros(couplings.joints)
    np.add.at(weight, couplings.root[told], slopes[told] ** 2)
    np.add.at(way, couplings.root[told], slopes[told] * (felt - about)[told])
    known = weight > 0.0
    roots = about + np.divide(way, weight, out=np.zeros_like(way), where=known)
    sd = np.divide(sigma, np.sqrt(weight), out=np.zeros_like(way), where=known)
    return Fused(couplings.follow(roots), known[couplings.root], couplings.spread(about) * sd)


def place(couplings: Couplings, mean: Array, covariance: Array) -> None:
    """Put followers where their roots are.

    Args:
        couplings: of J joints.
        mean: (S·J,), of the states of all joints one number after the other: angle, velocity and acceleration of
            now, then angles of the past; changed.
        covariance: (S·J, S·J), in the same order; changed.
    """
    joints = couplings.joints
    states, size = mean.reshape(-1, joints), mean.size // joints
    speeds = [1, 2]
    angles = np.setdiff1d(np.arange(size), speeds)
    states[angles] = couplings.follow(states[angles])
    slopes = np.ones((size, joints))
    slopes[angles] = couplings.slopes(states[angles])
    slopes[speeds] = slopes[0]
    states[speeds] = slopes[0] * states[speeds][:, couplings.root]
    blocks = covariance.reshape(size, joints, size, joints)
    for follower in np.flatnonzero(couplings.follows):
        root = couplings.root[follower]
        blocks[:, follower] = slopes[:, follower, None, None] * blocks[:, root]
        blocks[:, :, :, follower] = slopes[:, follower] * blocks[:, :, :, root]
        blocks[angles, follower, angles, follower] += SLACK**2
