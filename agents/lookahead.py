"""Looking ahead, compiled: where torques would take the hand if the object were this or that, and what would be felt.

Shapes: M candidate torques, K worlds (hypotheses that are taken for true), H hypotheses, C labels, J joints, D = 2J, L
links, P patches, T looks within the horizon. Kernels are pure, and each candidate is computed in one order: the same
bits for any number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel
from haptic_env.hand import Hand
from observer.kinematics import body_frames, point_jacobian
from observer.novelty import LinkHistory, ends, repeated
from observer.shape.contact_likelihood import CLEAR, LEAST, link_likelihood, patch_gaps
from observer.shape.distance_fields import distance_from, way_out

ALONG = 4  # spheres that stand for each link where it may meet the object
STEP = 0.001  # metres, of the differences that give the object's normal
FELT = 0.001  # metres: a patch this near would feel contact (points of the skin lie some millimetres apart)


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


class LookaheadModel(NamedTuple):
    """What weighs what would be felt.

    Attributes:
        tolerance: m, of a gap.
        surprise: probability of a contact that no hypothesis explains.
        weight: exponent of a look.
        said: what was felt before.
        alike: m, from there a contact is no news; 0: all of it is.
        press: m, how deep what feels contact may.
    """

    tolerance: float
    surprise: float
    weight: float
    said: LinkHistory
    alike: float
    press: float = 0.0


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
def _hold_out(tree, spheres, solids, h, line, x, position, rotation, jacobian, moved):
    """Push the state `x` (D,) out of hypothesis `h`: for each link that is in it, by the force along its normal that
    takes it to the surface within a control step. The frames are left at where it was."""
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
def roll(tree, spheres, solids, h, line, torque, every, looks):
    """Move the hand under one torque, if one hypothesis were there.

    Args:
        tree: of the hand's joints.
        spheres: that the object stops.
        solids: distance fields of the hypotheses.
        h: the hypothesis.
        line: the forward model.
        torque: (J,) N·m, beyond those of now.
        every: control steps from one look to the next.
        looks: (T, J) rad, filled with the pose at each look.
    """
    joints, size = len(line.low), len(line.state)
    x, free, moved = line.state.copy(), np.empty(size), np.empty(size)
    position, rotation = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
    jacobian = np.empty((3, joints))
    push = line.gain @ torque
    for step in range(every * len(looks)):
        for i in range(size):
            free[i] = line.drift[i] + push[i]
            for j in range(size):
                free[i] += line.transition[i, j] * (x[j] - line.state[j])
        x[:] = free
        _hold_out(tree, spheres, solids, h, line, x, position, rotation, jacobian, moved)
        for j in range(joints):
            if x[j] < line.low[j] or x[j] > line.high[j]:
                x[j] = min(max(x[j], line.low[j]), line.high[j])
                x[joints + j] = 0.0
        if (step + 1) % every == 0:
            looks[step // every] = x[:joints]


@inner()
def _feel(skin, solids, world, told, log_likelihood, scratch):
    """Add to `log_likelihood` (H,) what the contacts of a hand whose frames are in `scratch` say of each hypothesis,
    were `world` the true one, as `observer.shape.contact_likelihood` has it."""
    position, rotation, felt, gaps, place, rings = scratch
    said, clear = told.said, CLEAR * told.tolerance
    for link in range(len(skin.body)):
        body = skin.body[link]
        first, end = skin.first_patch[link], skin.first_patch[link + 1]
        near = patch_gaps(solids, world, skin, link, position[body], rotation[body], clear, felt)
        touches = 0
        for patch in range(first, end):
            if near and felt[patch] < FELT:
                touches += 1
            else:
                felt[patch] = clear
            rings[patch] = felt[patch] < FELT
        weight = told.weight
        if told.alike > 0.0:
            ends(said.length[link], position[body], rotation[body], place)
            weight *= max(1.0 - repeated(said, link, place, rings, touches, told.alike), 0.0)
        if weight == 0.0:
            continue
        for h in range(len(log_likelihood)):
            likelihood = link_likelihood(
                solids,
                h,
                skin,
                link,
                position[body],
                rotation[body],
                rings,
                touches,
                told.tolerance,
                told.press,
                told.surprise,
                weight,
                gaps,
            )
            if likelihood < 1.0:
                log_likelihood[h] += np.log(max(likelihood, LEAST))


@kernel()
def _class_entropy(log_weights, log_likelihood, label, labels):
    """Entropy (bits) of the posterior of the labels."""
    top = -np.inf
    for h in range(len(label)):
        top = max(top, log_weights[h] + log_likelihood[h])
    share = np.zeros(labels)
    for h in range(len(label)):
        share[label[h]] += np.exp(log_weights[h] + log_likelihood[h] - top)
    total, entropy = share.sum(), 0.0
    for c in range(labels):
        if share[c] > 0.0:
            entropy -= share[c] / total * np.log2(share[c] / total)
    return entropy


@kernel()
def class_entropies(
    begin,
    end,
    tree,
    spheres,
    skin,
    solids,
    line,
    torques,
    every,
    looks,
    worlds,
    log_weights,
    label,
    labels,
    told,
    out,
):
    """Predict how uncertain the label will be, for torques that are held for T = `looks` times `every` steps.

    Args:
        begin: first of the torques that are looked at.
        end: the one after the last.
        tree: of the hand's joints.
        spheres: that the object stops.
        skin: of the hand.
        solids: distance fields of the hypotheses.
        line: the forward model.
        torques: (M, J) N·m, beyond those of now.
        every: control steps from one look to the next.
        looks: T.
        worlds: (K,) hypotheses, each taken for the true one.
        log_weights: (H,) of the hypotheses.
        label: (H,) of the hypotheses.
        labels: C.
        told: weighs what would be felt.
        out: (M, K) bits, filled from `begin` to `end`: the entropy that is left.
    """
    for m in range(begin, end):
        poses = np.empty((looks, len(line.low)))
        log_likelihood = np.empty(len(label))
        patches = skin.first_patch[-1]
        scratch = (
            np.empty((len(tree.parent), 3)),
            np.empty((len(tree.parent), 3, 3)),
            np.empty(patches),
            np.empty(patches),
            np.empty(6),
            np.empty(patches, dtype=np.bool_),
        )
        for k in range(len(worlds)):
            roll(tree, spheres, solids, worlds[k], line, torques[m], every, poses)
            log_likelihood[:] = 0.0
            for t in range(looks):
                body_frames(tree, poses[t], scratch[0], scratch[1])
                _feel(skin, solids, worlds[k], told, log_likelihood, scratch)
            out[m, k] = _class_entropy(log_weights, log_likelihood, label, labels)
