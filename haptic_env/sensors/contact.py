"""Detection of contact: a patch may miss a touch, ring falsely or for its neighbour, or not work at all.

Shapes: P patches.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import readable, validate
from haptic_env.neighbours import neighbours
from haptic_env.patches import Patches

Faults = float | Sequence[int | str]


class ContactDetection:
    """A touch is felt at a neighbouring patch instead with probability `confusion`; then a patch at which one is felt
    reports 0 with probability `miss`, any other reports 1 with `false_alarm`; and patches that are stuck on, or dead,
    report 1, or 0, whatever is felt.

    Attributes:
        miss: probability.
        false_alarm: probability.
        confusion: probability.
        beside: (P, P) how a touch that is felt elsewhere is shared out among the neighbours of its patch.
        chances: (2, P) that each patch is stuck, and dead, before the reset.
        stuck: (P,) which patches are stuck on in this episode.
        dead: (P,) which patches are dead.
    """

    __repr__ = readable.line

    def __init__(
        self,
        miss: float = 0.0,
        false_alarm: float = 0.0,
        confusion: float = 0.0,
        stuck: Faults = 0.0,
        dead: Faults = 0.0,
        patches: Patches | None = None,
    ) -> None:
        """Check the probabilities.

        Args:
            miss: that a touched patch reports 0, at each step.
            false_alarm: that an untouched patch reports 1, at each step.
            confusion: that a touch is felt at one of the neighbouring patches instead, each as probable, at each step.
            stuck: the patches that always report 1, by index or name; or the probability of each, drawn at the reset.
            dead: the patches that always report 0, likewise.
            patches: of the hand; None: no confusion, and all patches work.

        Raises:
            ValueError: for what is none in [0, 1], patches that there are not, and patches both stuck and dead.
        """
        self.miss = validate.number("contact_miss", miss, 0.0, 1.0)
        self.false_alarm = validate.number("contact_false_alarm", false_alarm, 0.0, 1.0)
        self.confusion = validate.number("contact_confusion", confusion, 0.0, 1.0)
        names = patches.names if patches is not None else ()
        told = {"patches_stuck": stuck, "patches_dead": dead}
        self.chances = np.array([_chances(what, given, names) for what, given in told.items()])
        for each, other in ((0, 1), (1, 0)):
            if _is_list((stuck, dead)[each]) and not _is_list((stuck, dead)[other]):
                self.chances[other, self.chances[each] == 1.0] = 0.0  # of a patch of which it is told what it does
        if patches is None and (self.confusion or any(_is_list(each) or each for each in (stuck, dead))):
            raise ValueError("patches must be those of a hand where touches are confused or patches may not work")
        both = np.flatnonzero(self.chances.sum(axis=0) > 1.0)
        if both.size:
            raise ValueError(
                f"patch {names[both[0]]!r} cannot be both stuck and dead: patches_stuck={validate.shown(stuck)} and "
                f"patches_dead={validate.shown(dead)} come to more than 1"
            )
        self.beside = np.zeros((len(names), len(names)))
        if patches is not None:
            near = neighbours(patches)
            self.beside = near / np.maximum(near.sum(axis=1, keepdims=True), 1)
        self.stuck, self.dead = self.chances >= 1.0

    def reset(self, rng: np.random.Generator) -> None:
        """Draw which patches do not work in the episode.

        Args:
            rng: gives the draws.
        """
        stuck, dead = self.chances
        chance = rng.random(len(stuck))
        self.stuck, self.dead = chance < stuck, (chance >= stuck) & (chance < stuck + dead)

    def sample(self, rng: np.random.Generator, touched: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Draw what is reported.

        Args:
            rng: gives the draws.
            touched: (P,) the patches really touched.

        Returns:
            (P,) the reported contacts.
        """
        felt = self._confused(rng, touched) if self.confusion else touched.copy()
        if self.miss or self.false_alarm:
            chance = rng.random(felt.shape)
            felt = np.where(felt, chance >= self.miss, chance < self.false_alarm)
        return (felt | self.stuck) & ~self.dead if self.chances.any() else felt

    def _confused(self, rng: np.random.Generator, touched: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(P,): where the touches of the `touched` (P,) patches are felt."""
        leaves, which = rng.random((2, len(touched)))
        moved = touched & (leaves < self.confusion) & self.beside.any(axis=1)
        felt = touched & ~moved
        for patch in np.flatnonzero(moved):
            near = np.flatnonzero(self.beside[patch])
            felt[near[int(which[patch] * len(near))]] = True
        return felt

    def log_prob(self, contacts: ArrayLike, touch_probability: ArrayLike) -> float:
        """Score what was reported, patch by patch: that a touch felt at one patch is not felt at another is left out.

        Args:
            contacts: (P,) as reported, 0 or 1.
            touch_probability: (P,) that each patch is touched.

        Returns:
            The log probability.

        Raises:
            ValueError: for contacts that are not 0 or 1, no probabilities, or other shapes.
        """
        touch = validate.probabilities("touch_probability", touch_probability)
        rang = validate.binary("contacts", contacts, touch.shape)
        if len(self.beside) and touch.shape != self.stuck.shape:
            raise ValueError(f"touch_probability must be of shape {self.stuck.shape}, got shape {touch.shape}")
        ring = self.rings(self.felt(touch) if self.confusion else touch)
        if self.chances.any():
            ring = np.where(self.stuck, 1.0, np.where(self.dead, 0.0, ring))
        with np.errstate(divide="ignore"):
            return float(np.log(np.where(rang, ring, 1 - ring)).sum())

    def rings(self, felt: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give the probability that a patch which works reports 1.

        Args:
            felt: (…) that a touch is felt at it.

        Returns:
            (…).
        """
        return (1 - self.miss) * felt + self.false_alarm * (1 - felt)

    def felt(self, touch: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give the probability that a touch is felt at each patch, its own or that of a neighbour.

        Args:
            touch: (P,) that each patch is touched, independently.

        Returns:
            (P,).
        """
        return 1.0 - (1.0 - self.stays * touch) * self.spared(touch)

    @property
    def stays(self) -> NDArray[np.float64]:
        """(P,) probability that a touch is felt at its own patch: 1 where there is no other."""
        return np.where(self.beside.any(axis=1), 1.0 - self.confusion, 1.0)

    def spared(self, touch: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give the probability that no neighbour's touch is felt at each patch.

        Args:
            touch: (P,) that each patch is touched, independently.

        Returns:
            (P,).
        """
        return np.asarray(np.prod(1.0 - self.confusion * self.beside * touch[:, None], axis=0))


def _is_list(given: Any) -> bool:
    return isinstance(given, list | tuple) or (isinstance(given, np.ndarray) and given.ndim == 1)


def _chances(what: str, given: Any, names: Sequence[str]) -> NDArray[np.float64]:
    """(P,) probability of each patch of `names` that it has the fault `what`."""
    if not _is_list(given):
        valid = f"a finite number in [0, 1], the probability of each patch, or a list of patches, {_valid(names)}"
        try:
            return np.full(len(names), validate.number(what, given, 0.0, 1.0))
        except ValueError as error:
            raise ValueError(f"{what} must be {valid}, got {validate.shown(given)}") from error
    chances = np.zeros(len(names))
    for each in given:
        if isinstance(each, str):
            chances[list(names).index(validate.choice(f"patch of {what}", each, names))] = 1.0
        else:
            chances[validate.integer(f"patch of {what}", each, 0, len(names) - 1)] = 1.0
    return chances


def _valid(names: Sequence[str]) -> str:
    return f"indices in [0, {len(names) - 1}] or names such as {names[0]!r}" if names else "of which none are given"
