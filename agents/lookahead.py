"""Looking ahead, compiled: what would be felt where torques take the hand (`agents.rollouts`), and what it would tell.

Shapes: M candidate torques, K worlds (hypotheses that are taken for true), H hypotheses, C labels, J joints, L links,
P patches, T looks within the horizon. Kernels are pure, and each candidate is computed in one order: the same bits for
any number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.rollouts import roll
from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel
from observer.kinematics import body_frames
from observer.novelty import LinkHistory, ends, repeated
from observer.shape.contact_likelihood import (
    CLEAR,
    LEAST,
    TouchModel,
    WeighedTouch,
    link_likelihood,
)
from observer.shape.distance_fields import Solids
from observer.shape.link_gaps import patch_gaps, scratch_of

FELT = 0.001  # metres: a patch this near would feel contact (points of the skin lie some millimetres apart)


class Worlds(NamedTuple):
    """What may be true.

    Attributes:
        solids: distance fields of H hypotheses.
        log_weights: (H,).
        label: (H,) index.
        truths: (K,) hypotheses, each taken for the true one in turn.
    """

    solids: Solids
    log_weights: Array
    label: NDArray[np.int64]
    truths: NDArray[np.int64]


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


@inner()
def _feel(skin, solids, world, told, log_likelihood, scratch):
    """Add to `log_likelihood` (H,) what the contacts of a hand whose frames are in `scratch` say of each hypothesis,
    were `world` the true one, as `observer.shape.contact_likelihood` has it."""
    position, rotation, felt, of_gaps, place, rings = scratch
    said, clear = told.said, CLEAR * told.tolerance
    model = TouchModel(told.tolerance, told.press, told.surprise)
    for link in range(len(skin.body)):
        frame = position[skin.body[link]], rotation[skin.body[link]]
        first, end = skin.first_patch[link], skin.first_patch[link + 1]
        near = patch_gaps(solids, world, skin, link, frame, clear, felt) < clear
        touches = 0
        for patch in range(first, end):
            if near and felt[patch] < FELT:
                touches += 1
            else:
                felt[patch] = clear
            rings[patch] = felt[patch] < FELT
        weight = told.weight
        if told.alike > 0.0:
            ends(said.length[link], *frame, place)
            weight *= max(1.0 - repeated(said, link, place, rings, touches, told.alike), 0.0)
        if weight == 0.0:
            continue
        for h in range(len(log_likelihood)):
            mine = WeighedTouch(rings, touches, weight)
            likelihood = link_likelihood(solids, h, skin, link, frame, mine, model, of_gaps)
            if likelihood < 1.0:
                log_likelihood[h] += np.log(max(likelihood, LEAST))


@kernel()
def _class_entropy(worlds, log_likelihood):
    """Entropy (bits) of the posterior of the labels."""
    log_weights, label = worlds.log_weights, worlds.label
    top = -np.inf
    for h in range(len(label)):
        top = max(top, log_weights[h] + log_likelihood[h])
    share = np.zeros(label.max() + 1)
    for h in range(len(label)):
        share[label[h]] += np.exp(log_weights[h] + log_likelihood[h] - top)
    total, entropy = share.sum(), 0.0
    for c in range(len(share)):
        if share[c] > 0.0:
            entropy -= share[c] / total * np.log2(share[c] / total)
    return entropy


@kernel()
def class_entropies(begin, end, hand, worlds, plan, told, out):
    """Predict how uncertain the label will be after each of several torques.

    Args:
        begin: first of the torques that are looked at.
        end: the one after the last.
        hand: the `LookaheadHand`.
        worlds: what may be true.
        plan: what the hand may do.
        told: weighs what would be felt.
        out: (M, K) bits, filled from `begin` to `end`: the entropy that is left.
    """
    bodies, patches = len(hand.tree.parent), hand.skin.first_patch[-1]
    for m in range(begin, end):
        poses = np.empty((plan.looks, len(plan.line.low)))
        log_likelihood = np.empty(len(worlds.label))
        scratch = (
            np.empty((bodies, 3)),
            np.empty((bodies, 3, 3)),
            np.empty(patches),
            scratch_of(hand.skin, patches),
            np.empty(6),
            np.empty(patches, dtype=np.bool_),
        )
        for k in range(len(worlds.truths)):
            truth = worlds.truths[k]
            roll(hand, worlds.solids, truth, plan, m, poses)
            log_likelihood[:] = 0.0
            for t in range(plan.looks):
                body_frames(hand.tree, poses[t], scratch[0], scratch[1])
                _feel(hand.skin, worlds.solids, truth, told, log_likelihood, scratch)
            out[m, k] = _class_entropy(worlds, log_likelihood)
