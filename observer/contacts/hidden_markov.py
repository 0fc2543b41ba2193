"""A hidden Markov model of each patch: where it is about the object, and whether it works.

Shapes: P patches, S states, W steps of a window, E pairs of neighbours.

A patch that works is away from the object, near it or in touch with it, as a Markov chain; near is where touches
chatter: most that end are felt again within a few steps. A patch that is stuck, or dead, is so all along. Where touches
may be felt at a neighbour, the chains of neighbours are coupled: each is told the others' probabilities of touch given
all but what is said at the same step (loopy belief propagation; Murphy, Weiss & Jordan 1999, UAI). Without that all is
exact: forward-backward (Rabiner 1989, Proc. IEEE 77, 257-286).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import fractional_matrix_power

from haptic_env.arrays import Array
from haptic_env.compiled import kernel, part
from haptic_env.sensors import ContactDetection

Bools = NDArray[np.bool_]
AWAY, NEAR, TOUCH, STUCK, DEAD = range(5)
# Each row: from away, near, touch to these, by expectation maximisation (Baum & al. 1970) from the true contacts of 128
# explorations of 10 s by random torques, the four shapes with seeds 100000 to 100031, at `RATES_HZ`.
RATES = np.array([[0.9988, 0.0007, 0.0005], [0.081, 0.636, 0.283], [0.037, 0.228, 0.735]])
RATES_HZ = 50.0


class PatchModel(NamedTuple):
    """The hidden Markov model, for compiled code.

    Attributes:
        transition: (S, S), from each state (row) to each.
        prior: (P, S) before the first step.
        miss: probability that a patch which feels a touch reports none.
        false_alarm: probability that one which feels none reports one.
        stays: (P,) probability that a touch is felt at its own patch.
        first: (P + 1,) the neighbours of patch p are `near[first[p]]` up to `near[first[p + 1]]`.
        near: (E,).
        to: (E,) probability that a touch of the patch is felt at that neighbour.
        of: (E,) probability that a touch of that neighbour is felt at the patch.
    """

    transition: Array
    prior: Array
    miss: float
    false_alarm: float
    stays: Array
    first: NDArray[np.int64]
    near: NDArray[np.int64]
    to: Array
    of: Array


def transition(control_hz: float) -> Array:
    """Give the transitions of a step.

    Args:
        control_hz: Hz, of the steps.

    Returns:
        (S, S).
    """
    rates = np.eye(5)
    moved = np.maximum(np.real(fractional_matrix_power(RATES, RATES_HZ / control_hz)), 0.0)
    rates[:3, :3] = moved / moved.sum(axis=1, keepdims=True)
    return rates


def patch_model(detection: ContactDetection, control_hz: float) -> PatchModel:
    """Make the model of patches that report as `detection` does.

    Args:
        detection: with the patches of a hand.
        control_hz: Hz, of the steps.

    Returns:
        The model.
    """
    stuck, dead = detection.chances
    prior = np.zeros((len(stuck), 5))
    prior[:, AWAY], prior[:, STUCK], prior[:, DEAD] = 1.0 - stuck - dead, stuck, dead
    apart = detection.confusion * detection.beside
    patch, near = np.nonzero(apart)
    return PatchModel(
        transition(control_hz),
        prior,
        detection.miss,
        detection.false_alarm,
        detection.stays,
        np.searchsorted(patch, np.arange(len(stuck) + 1)).astype(np.int64),
        near.astype(np.int64),
        apart[patch, near],
        apart[near, patch],
    )


@part()
def reported(model: PatchModel, contact: bool, spared: float) -> float:
    """Give the probability of what a patch that works reports.

    Args:
        model: the `PatchModel`.
        contact: what it reports.
        spared: probability that no touch is felt at it.

    Returns:
        The probability.
    """
    ring = (1.0 - model.miss) * (1.0 - spared) + model.false_alarm * spared
    return ring if contact else 1.0 - ring


@part()
def told(model: PatchModel, condition: Array, contacts: Bools, apart: Array, patch: int, told: Array) -> None:
    """Tell what is reported at one step under each state of a patch.

    Args:
        model: the `PatchModel`.
        condition: (P, S) probabilities of the states at another step.
        contacts: (P,) that are reported.
        apart: (P,) that each patch is touched, what is reported at this step left out.
        patch: index.
        told: (S,) filled with the probability of what is said of it.
    """
    spared = 1.0
    for k in range(model.first[patch], model.first[patch + 1]):
        spared *= 1.0 - model.of[k] * apart[model.near[k]]
    untouched = reported(model, contacts[patch], spared)
    # A touch is felt at one place: at its own patch, or at one of the neighbours, whose reports come on the way.
    touched, neighbours = model.stays[patch] * reported(model, contacts[patch], 0.0), 1.0
    for k in range(model.first[patch], model.first[patch + 1]):
        other = model.near[k]
        theirs = 1.0 - model.stays[other] * apart[other]
        for i in range(model.first[other], model.first[other + 1]):
            if model.near[i] != patch:
                theirs *= 1.0 - model.of[i] * apart[model.near[i]]
        stuck, dead = condition[other, STUCK], condition[other, DEAD]
        faulty, works = stuck if contacts[other] else dead, 1.0 - stuck - dead
        nothing = works * reported(model, contacts[other], theirs) + faulty
        touched *= nothing
        touched += model.to[k] * (works * reported(model, contacts[other], 0.0) + faulty) * untouched
        untouched *= nothing
        neighbours *= nothing
    told[AWAY] = told[NEAR] = untouched
    told[TOUCH] = touched
    told[STUCK], told[DEAD] = (neighbours, 0.0) if contacts[patch] else (0.0, neighbours)


@part()
def step_on(transition: Array, before: Array, predicted: Array) -> None:
    """Predict the states of the next step.

    Args:
        transition: (S, S).
        before: (S,).
        predicted: (S,) filled.
    """
    for j in range(len(predicted)):
        predicted[j] = 0.0
        for i in range(len(before)):
            predicted[j] += before[i] * transition[i, j]


@part()
def take_in(predicted: Array, said: Array, state: Array) -> None:
    """Condition on a report; one that is impossible says nothing.

    Args:
        predicted: (S,) probabilities.
        said: (S,) probability of the report under each; all 1 where it is impossible.
        state: (S,) filled with the posterior.
    """
    total = 0.0
    for i in range(len(state)):
        state[i] = predicted[i] * said[i]
        total += state[i]
    if total <= 0.0:
        for i in range(len(state)):
            state[i], said[i] = predicted[i], 1.0
        return
    for i in range(len(state)):
        state[i] /= total


@kernel()
def smooth(
    model: PatchModel, start: Array, contacts: Bools, apart: Array, touched: Array, first: Array, last: Array
) -> None:
    """Smooth a window of steps, forward and backward.

    Args:
        model: the `PatchModel`.
        start: (P, S) posterior before its first step.
        contacts: (W, P) that were reported.
        apart: (W, P) probability that each patch was touched, what was reported at the step left out; taken from the
            last time, and brought up to date.
        touched: (W, P) filled with the probability that it was touched given all.
        first: (P, S) filled with the posterior after the first step.
        last: (P, S) filled with the posterior after the last one.
    """
    steps, patches = contacts.shape
    states = start.shape[1]
    said, predicted = np.empty((steps, states)), np.empty((steps, states))
    state, after, total = np.empty(states), np.empty(states), 0.0
    fresh = np.empty_like(apart)
    for patch in range(patches):
        state[:] = start[patch]
        for t in range(steps):
            told(model, start, contacts[t], apart[t], patch, said[t])
            step_on(model.transition, state, predicted[t])
            take_in(predicted[t], said[t], state)
            if t == 0:
                first[patch] = state
        last[patch] = state
        after[:] = 1.0
        for t in range(steps - 1, -1, -1):
            total = given = 0.0
            for i in range(states):
                state[i] = predicted[t, i] * after[i]
                total += state[i]
                given += state[i] * said[t, i]
            fresh[t, patch] = state[TOUCH] / total
            touched[t, patch] = state[TOUCH] * said[t, TOUCH] / given
            total = 0.0
            for i in range(states):
                state[i] = said[t, i] * after[i]
            for i in range(states):
                after[i] = 0.0
                for j in range(states):
                    after[i] += model.transition[i, j] * state[j]
                total += after[i]
            for i in range(states):
                after[i] /= total
    apart[:] = fresh
