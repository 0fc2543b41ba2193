"""Looking ahead, compiled: where torques would take the hand if the object were this or that.

Shapes: M candidate torques, H hypotheses, J joints, D = 2J, L links, B spheres, T looks within the horizon.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from haptic_env.hand import Hand
from observer.jacobians import point_jacobian
from observer.kinematics import Tree, body_frames, tree_of
from observer.shape.distance_fields import distance_from, way_out
from observer.shape.skin import Skin, skin_of

ALONG = 4  # spheres that stand for each link where it may meet the object
STEP = 0.001  # metres, of the differences that give the object's normal


class Spheres(NamedTuple):
    """The links as spheres, B of them.

    Attributes:
        body: (B,) on which each is.
        along: (B,) m, how far along its bone.
        radius: (B,) m.
    """

    body: NDArray[np.int64]
    along: Array
    radius: Array


class LookaheadHand(NamedTuple):
    """The hand, for whoever looks ahead.

    Attributes:
        tree: its kinematics.
        spheres: that the object stops.
        skin: that feels it.
    """

    tree: Tree
    spheres: Spheres
    skin: Skin


class Line(NamedTuple):
    """The forward model about now: x ← `drift` + `transition` (x - `state`) + `gain` (τ - τ₀), in one control step.

    Attributes:
        state: (D,) rad and rad/s, x now.
        drift: (D,), x after a step under τ₀.
        transition: (D, D).
        gain: (D, J) per N·m.
        low: (J,) rad, below which no joint gets.
        high: (J,) rad.
    """

    state: Array
    drift: Array
    transition: Array
    gain: Array
    low: Array
    high: Array


class Plan(NamedTuple):
    """What the hand may do: each of the torques, for T = `looks` times `every` steps.

    Attributes:
        line: the forward model about now.
        torques: (M, J) N·m, beyond those of now.
        every: control steps from one look to the next.
        looks: T.
    """

    line: Line
    torques: Array
    every: int
    looks: int


class Rollout(NamedTuple):
    """Room for one step of a hand: frames of its bodies, `jacobian` (3, J) of a point, and `moved` (D,)."""

    position: Array
    rotation: Array
    jacobian: Array
    moved: Array


def hand_of(hand: Hand) -> LookaheadHand:
    """Make the arrays of a hand.

    Args:
        hand: any.

    Returns:
        The arrays.
    """
    return LookaheadHand(tree_of(hand), spheres_of(hand), skin_of(hand))


def spheres_of(hand: Hand) -> Spheres:
    """Put spheres along the links of a hand.

    Args:
        hand: with links.

    Returns:
        `ALONG` spheres for each link, from one end of its bone to the other.
    """
    share = np.tile(np.linspace(0.0, 1.0, ALONG), len(hand.links))
    return Spheres(
        np.repeat(hand.link_bodies, ALONG).astype(np.int64),
        share * np.repeat([link.length for link in hand.links], ALONG),
        np.repeat([link.radius for link in hand.links], ALONG),
    )


@kernel()
def _hold_out(hand, solids, h, line, x, rollout):
    """Push the state `x` (D,) out of hypothesis `h`: for each link that is in it, by the force along its normal that
    takes it to the surface within a control step. The frames are left at where it was."""
    (tree, spheres, _), (position, rotation, jacobian, moved) = hand, rollout
    joints = len(line.low)
    body_frames(tree, x[:joints], position, rotation)
    normal, torque = np.empty(3), np.empty(joints)
    first = 0
    while first < len(spheres.body):
        body = spheres.body[first]
        deepest, at = 0.0, -1
        for b in range(first, first + ALONG):
            s = spheres.along[b]
            gap = distance_from(
                solids,
                h,
                position[body, 0] + s * rotation[body, 0, 2],
                position[body, 1] + s * rotation[body, 1, 2],
                position[body, 2] + s * rotation[body, 2, 2],
            )
            gap -= spheres.radius[b]
            if gap < deepest:
                deepest, at = gap, b
        first += ALONG
        if at < 0:
            continue
        point = position[body] + spheres.along[at] * rotation[body][:, 2]
        way_out(solids, h, point[0], point[1], point[2], STEP, normal)
        point_jacobian(tree, x[:joints], position, rotation, body, point, jacobian)
        for j in range(joints):
            torque[j] = jacobian[0, j] * normal[0] + jacobian[1, j] * normal[1] + jacobian[2, j] * normal[2]
        give = 0.0
        for i in range(2 * joints):
            moved[i] = 0.0
            for j in range(joints):
                moved[i] += line.gain[i, j] * torque[j]
        for j in range(joints):
            give += torque[j] * moved[j]
        if give > 0.0:
            for i in range(2 * joints):
                x[i] -= deepest / give * moved[i]


@kernel()
def roll(hand, solids, h, plan, m, looks):
    """Move the hand under one torque, if one hypothesis were there.

    Args:
        hand: the `LookaheadHand`.
        solids: distance fields of the hypotheses.
        h: index of the hypothesis.
        plan: the `Plan`.
        m: index of the torque.
        looks: (T, J) rad, filled with the pose at each look.
    """
    line, bodies = plan.line, len(hand.tree.parent)
    joints, size = len(line.low), len(line.state)
    x, free = line.state.copy(), np.empty(size)
    rollout = Rollout(np.empty((bodies, 3)), np.empty((bodies, 3, 3)), np.empty((3, joints)), np.empty(size))
    push = line.gain @ plan.torques[m]
    for step in range(plan.every * len(looks)):
        for i in range(size):
            free[i] = line.drift[i] + push[i]
            for j in range(size):
                free[i] += line.transition[i, j] * (x[j] - line.state[j])
        x[:] = free
        _hold_out(hand, solids, h, line, x, rollout)
        for j in range(joints):
            if x[j] < line.low[j] or x[j] > line.high[j]:
                x[j] = min(max(x[j], line.low[j]), line.high[j])
                x[joints + j] = 0.0
        if (step + 1) % plan.every == 0:
            looks[step // plan.every] = x[:joints]
