"""What is said of contacts by whoever knows of no object at all.

Shapes: P patches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, log_expit

from haptic_env.arrays import Array
from haptic_env.moved import renamed

__getattr__ = renamed(__name__, {"Habit": "NullModel"})
DOUBT = 0.03  # exponent of the evidence for "none": a wrong model of touch is wrong in the same way all along


class NullModel:
    """Touch without any object: each patch begins to feel contact, or ceases to, at a rate that is learned from the
    trial itself. What no candidate explains better than this is none of them.

    A Markov chain with Beta priors; their means are the rates of 48 explorations with random torques (seeds 0 to 11),
    their weight is that of a few touches. Links as a whole are touched more often than one of their patches: theirs are
    the rates of 24 such explorations of two hands (seeds 900000 to 900002).
    """

    BEGIN = (0.7, 250.0)  # pseudo-counts: silent patches that began to feel contact, and all that were silent
    CEASE = (2.0, 7.5)  # the same for patches in contact that ceased
    LINK_BEGINS = (0.7, 42.0)  # as `BEGIN`, of links

    def __init__(self, patches: int, begin: tuple[float, float] = BEGIN) -> None:
        """Begin with nothing felt.

        Args:
            patches: P, or of links as a whole how many there are.
            begin: pseudo-counts of those that began to feel contact, and of all that were silent.
        """
        self.log_likelihood = 0.0
        self._felt = np.zeros(patches, dtype=bool)
        self._counts = np.array([begin, self.CEASE])

    @staticmethod
    def weight(temper: float, stride: int) -> float:
        """Tell the exponent of what `evidence` says against all candidates: `DOUBT`, whatever part of a look counts.

        Args:
            temper: exponent of the evidence of a look.
            stride: steps for which a look stands.

        Returns:
            The exponent.
        """
        return DOUBT * stride / temper

    def evidence(self, candidates: Array, temper: float) -> float:
        """Tell the evidence of "none".

        Args:
            candidates: (C,) nats, that of each candidate, which says nothing of it.
            temper: exponent of the evidence of a look.

        Returns:
            nats.
        """
        return temper * self.log_likelihood

    def update(
        self, contacts: NDArray[np.bool_], news: Array | None = None, unmeasured: NDArray[np.bool_] | None = None
    ) -> None:
        """Take in a step.

        Args:
            contacts: (P,).
            news: (P,) the share of each that counts; None: all of it.
            unmeasured: (P,) patches whose contact was not measured, which stay as they were; None: all were.
        """
        share = np.ones(len(contacts)) if news is None else news
        if unmeasured is not None:
            contacts, share = np.where(unmeasured, self._felt, contacts), np.where(unmeasured, 0.0, share)
        changes = contacts != self._felt
        for row, had in enumerate((~self._felt, self._felt)):
            # Patch by patch, each with the rate that those before it have taught: no rate is ever known exactly.
            changed, stayed = share[had & changes], share[had & ~changes]
            of, among = self._counts[row]
            self.log_likelihood += _chain(changed, of, among) + _chain(stayed, among - of, among + changed.sum())
            self._counts[row] += changed.sum(), changed.sum() + stayed.sum()
        self._felt = contacts


def shares(candidates: Array, null: float = 0.0, prior: float = 0.0, weight: float = 1.0, least: float = 0.0) -> Array:
    """Tell the posterior of labels.

    Args:
        candidates: (C,) log likelihood of each.
        null: log likelihood of "none of these".
        prior: probability of that; 0: there is no such label.
        weight: exponent of the evidence against all candidates.
        least: probability of "none" that is known otherwise.

    Returns:
        (C,), or (C + 1,) with "none" the last.
    """
    odds = np.exp(candidates - candidates.max())
    share = np.asarray(odds / odds.sum())
    if not prior:
        return share
    against = null - candidates.max() - np.log(odds.mean())
    none = max(expit(np.log(prior / (1.0 - prior)) + weight * against), least)
    return np.append((1.0 - none) * share, none)


def log_shares(
    candidates: Array, null: float = 0.0, prior: float = 0.0, weight: float = 1.0, least: float = 0.0
) -> Array:
    """Tell the log posterior of labels, of those too that are too improbable for a number.

    Args:
        candidates: as `shares` has them, and the others.
        null: likewise.
        prior: likewise.
        weight: likewise.
        least: likewise.

    Returns:
        (C,) nats, or (C + 1,).
    """
    total = np.logaddexp.reduce(candidates)
    share = candidates - total
    if not prior:
        return share
    against = null - total + np.log(len(candidates))
    none = np.log(prior / (1.0 - prior)) + weight * against
    if least > expit(none):
        return np.append(np.log1p(-least) + share, np.log(least))
    return np.append(log_expit(-none) + share, log_expit(none))


def _chain(share: Array, of: float, among: float) -> float:
    """Log probability of events of a rate `of` in `among`, with the exponents `share` (n,), which add to both."""
    before = np.cumsum(share) - share
    return float(share @ np.log((of + before) / (among + before)))
