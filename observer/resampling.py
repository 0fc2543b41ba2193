"""Systematic resampling (Carpenter, Clifford & Fearnhead 1999, IEE Proc. Radar 146, 2-7)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import kernel, part


@kernel()
def effective_sample_size(weights):
    """Count the particles that matter, Neff = 1 / Σ w² (paper, section 3, step 6).

    Args:
        weights: (N,), whose sum is 1.

    Returns:
        Neff, in [1, N].
    """
    total = 0.0
    for weight in weights:
        total += weight * weight
    return 1.0 / total


@part()
def exponentiate(score):
    """Turn logs of weights into weights, the largest of which is 1.

    Args:
        score: (K,), changed.

    Returns:
        The largest and the least of the logs, and the sum of the weights.
    """
    best = least = score[0]
    for c in range(len(score)):
        best, least = max(best, score[c]), min(least, score[c])
    total = 0.0
    for c in range(len(score)):
        score[c] = np.exp(score[c] - best)
        total += score[c]
    return best, least, total


@kernel()
def normalise(log_weights):
    """Take log Σw from the logs of weights.

    Args:
        log_weights: (N,), changed.

    Returns:
        log Σw, the weights (N,), whose sum is 1, and Neff. The first is not finite where a weight is not, or where all
        are 0.
    """
    most, weights = log_weights[0], np.empty(len(log_weights))
    for n in range(len(weights)):
        most = max(most, log_weights[n])
    total = 0.0
    for n in range(len(weights)):
        weights[n] = np.exp(log_weights[n] - most)
        total += weights[n]
    total = most + np.log(total)
    for n in range(len(weights)):
        log_weights[n] -= total
        weights[n] = np.exp(log_weights[n])
    return total, weights, effective_sample_size(weights)


@kernel()
def log_sums(log_weights, first, sums):
    """Add up weights, group by group.

    Args:
        log_weights: (N,) their logs.
        first: (G,) where each group begins; it ends where the next one begins.
        sums: (G,), filled with the logs of the sums.
    """
    for g in range(len(first)):
        end = first[g + 1] if g + 1 < len(first) else len(log_weights)
        most, total = -np.inf, 0.0
        for n in range(first[g], end):
            most = max(most, log_weights[n])
        if most == -np.inf:
            sums[g] = most
            continue
        for n in range(first[g], end):
            total += np.exp(log_weights[n] - most)
        sums[g] = most + np.log(total)


@kernel()
def effective_of_groups(log_weights, size, counts, effective):
    """Count the particles that matter (`effective_sample_size`), group by group.

    Args:
        log_weights: (G·size,) logs of the weights, whatever their sum.
        size: from where one group begins to where the next one does.
        counts: (G,) how many particles each group has.
        effective: (G,), filled.
    """
    for g in range(len(counts)):
        first = g * size
        most, total, square = -np.inf, 0.0, 0.0
        for n in range(first, first + counts[g]):
            most = max(most, log_weights[n])
        for n in range(first, first + counts[g]):
            weight = np.exp(log_weights[n] - most)
            total += weight
            square += weight * weight
        effective[g] = total * total / square


def systematic_counts(weights: NDArray[np.float64], uniform: float, copies: int | None = None) -> NDArray[np.int64]:
    """Deal out copies: C·w expected of each particle, never a whole copy away from it.

    Args:
        weights: (N,), whose sum is 1.
        uniform: random number in [0, 1).
        copies: C; None: as many as there are particles.

    Returns:
        (N,) copies, whose sum is C.
    """
    copies = len(weights) if copies is None else copies
    upto = np.clip(np.ceil(np.cumsum(weights) * copies - uniform), 0, copies).astype(np.int64)
    upto[-1] = copies  # whatever the rounding, all are dealt out
    return np.diff(upto, prepend=0)


def in_place(counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Copy so that every survivor stays where it is.

    Args:
        counts: (N,) copies of each.

    Returns:
        Which particle to copy (C,), and into which dead slot (C,).
    """
    dead = np.flatnonzero(counts == 0)
    spare = np.repeat(np.arange(len(counts)), np.maximum(counts - 1, 0))
    return spare, dead
