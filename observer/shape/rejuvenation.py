"""Hypotheses that lie any way: where the evidence has left few, they are moved by what was felt so far, all of it.

Shapes: H hypotheses, V variants of each solid, P patches. Lengths in metres.

A turn in space has many peaks: what fits an edge fits any edge. Variants that are drawn towards their mean (Liu & West,
`observer.shape.hypotheses`) would lie between them. So what was felt is kept, and a variant moves where it explains all
of that: Metropolis's rule, which leaves the posterior of a label as it is and its evidence untouched.

References:
    Gilks & Berzuini 2001, J. R. Statist. Soc. B 63, 127-146 (resample, then move).
    Chopin 2002, Biometrika 89, 539-551 (all that was observed decides on a move).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from observer.kinematics import Tree
from observer.shape.contact_likelihood import LEAST, PoseSamples, TouchModel, contact_likelihood
from observer.shape.distance_fields import Solids
from observer.shape.hypotheses import RANGES, Variants, reflected
from observer.shape.skin import Skin

FEWEST, MOST, REPLAYED = 3, 10, 400  # moves each time that a solid's variants are resampled: many while looks are few
AT_ONCE = 8  # looks, before it is seen which moves are refused already
AT_A_STEP = 20_000  # looks at hypotheses after which moves wait for the next step: some ten milliseconds
WORTH = 1e-3  # share of the posterior below which a solid's variants are resampled and not moved
FIRST_STEP, SHORTEST, LONGEST = 0.3, 0.006, 0.6  # of a range, and rad, of a move
VARIED = 0.7  # SD of the log of a step's length: short and long ones at any time
ANEW = 0.15  # of the moves: any turn at all
ACCEPTED = 0.3  # share of the moves that steps are made to have (Roberts et al. 1997)


class Look(NamedTuple):
    """What was felt at one step.

    Attributes:
        tree: the hand's kinematics, where the hand lay.
        samples: its pose.
        contacts: (P,).
        exponent: (L,) with which counts what each link says.
        model: of touch.
    """

    tree: Tree
    samples: PoseSamples
    contacts: NDArray[np.bool_]
    exponent: Array
    model: TouchModel


class Rejuvenation:
    """Keeps what was felt, and moves variants by it."""

    def __init__(self, variants: Variants, skin: Skin, parts: int, temper: float) -> None:
        """Begin before the first look.

        Args:
            variants: that are moved.
            skin: of the hand.
            parts: G, of the hand.
            temper: exponent of the evidence of a look.
        """
        self._variants, self._skin, self._parts, self._temper = variants, skin, parts, temper
        self._looks: list[Look] = []
        self._fit = np.zeros(variants.hypotheses)  # the log likelihood of all looks, of each hypothesis where it now is
        self._step = np.full(variants.hypotheses // variants.count, FIRST_STEP)
        self._due = np.zeros(len(self._step), dtype=np.int64)  # moves of each solid

    def take(self, look: Look, gained: Array) -> None:
        """Take note of what was felt.

        Args:
            look: copied.
            gained: (H,) its log likelihood, with the exponent `temper`.
        """
        tree, (poses, column), contacts, exponent, model = look
        self._looks.append(Look(tree, PoseSamples(poses.copy(), column), contacts.copy(), exponent.copy(), model))
        self._fit += gained

    def resample(self, units: Array, log_evidence: Array, rng: np.random.Generator) -> bool:
        """Resample the variants of each solid of which fewer than half are effective; they are to be moved.

        Args:
            units: (H, 9) as of `Variants.draw`, changed.
            log_evidence: (H,), changed; the sum over a solid's variants stays.
            rng: draws.

        Returns:
            Whether any has changed.
        """
        changed = False
        for mine, _, kept in self._variants.resampled(log_evidence, rng):
            units[mine], self._fit[mine] = units[mine][kept], self._fit[mine][kept]
            self._due[mine.start // self._variants.count] = np.clip(REPLAYED // len(self._looks), FEWEST, MOST)
            changed = True
        return changed

    def move(self, units: Array, log_evidence: Array, rng: np.random.Generator) -> bool:
        """Make some of the moves that are due, those of the likeliest solids first: no step takes long.

        Args:
            units: (H, 9) as of `Variants.draw`, changed.
            log_evidence: (H,).
            rng: draws.

        Returns:
            Whether any has moved.
        """
        if not self._due.any():
            return False
        share = np.exp(log_evidence - np.logaddexp.reduce(log_evidence)).reshape(len(self._due), -1).sum(axis=1)
        self._due[share < WORTH] = 0
        cost, spent = self._variants.count * len(self._looks), 0
        while self._due.any() and spent < AT_A_STEP:
            solid = int(np.argmax(np.where(self._due > 0, share, -1.0)))
            self._metropolis(units, solid, rng)
            self._due[solid] -= 1
            spent += cost
        return spent > 0

    def _metropolis(self, units: Array, solid: int, rng: np.random.Generator) -> None:
        """Propose one move to each variant of a solid, by steps of chance in all that is not known, and make it where
        Metropolis's rule says so."""
        count = self._variants.count
        mine = np.arange(solid * count, (solid + 1) * count)
        step = self._step[solid] * np.exp(VARIED * rng.standard_normal((count, 1)))
        proposed = units[mine]
        proposed[:, :RANGES] = reflected(proposed[:, :RANGES] + step * rng.standard_normal((count, RANGES)))
        anew = rng.random(count) < ANEW
        proposed[:, RANGES:] = self._variants.turned(proposed[:, RANGES:], step, anew, rng)
        least = self._fit[mine] + np.log(rng.random(count))
        fit = self._replay(self._variants.place(proposed, mine), least)
        accepted = fit > least
        units[mine[accepted]], self._fit[mine[accepted]] = proposed[accepted], fit[accepted]
        rate = accepted[~anew].mean() if not anew.all() else ACCEPTED
        self._step[solid] = np.clip(self._step[solid] * np.exp(0.5 * (rate - ACCEPTED)), SHORTEST, LONGEST)

    def _replay(self, solids: Solids, least: Array | None = None) -> Array:
        """Tell the log likelihood of all that was felt.

        No look adds to it, so that those of many touches, which tell most, refuse most proposals at once.

        Args:
            solids: M of them.
            least: (M,) what is of no use if it is not exceeded; None: all is.

        Returns:
            (M,), -inf where it is of no use.
        """
        total = np.zeros(len(solids.scale))
        left = np.arange(len(total))
        order = np.argsort([-look.contacts.sum() for look in self._looks], kind="stable")
        for first in range(0, len(order), AT_ONCE):
            alive = solids.of(left)
            likelihood = np.empty((self._parts, len(left), 1))
            for which in order[first : first + AT_ONCE]:
                tree, samples, contacts, exponent, model = self._looks[which]
                contact_likelihood(tree, self._skin, alive, samples, contacts, exponent, model, likelihood)
                total[left] += self._temper * np.log(np.maximum(likelihood, LEAST)).sum(axis=(0, 2))
            if least is not None:
                refused = total[left] <= least[left]
                total[left[refused]] = -np.inf
                left = left[~refused]
            if not len(left):
                break
        return total
