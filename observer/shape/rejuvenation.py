"""Hypotheses that lie any way: where the evidence has left few, they are moved by what was felt so far, all of it.

Shapes: H hypotheses, V variants of each solid, P patches. Lengths in metres.

A turn in space has many peaks: what fits an edge fits any edge. Variants that are drawn towards their mean (Liu & West,
`observer.shape.hypotheses`) would lie between them. So what was felt is kept, and a variant moves where it explains all
of that: Metropolis's rule, which leaves the posterior of a label as it is and its evidence untouched. Where all of a
solid's variants have missed what explains it, they are drawn anew about its modes (`observer.shape.mode_search`).

References:
    Gilks & Berzuini 2001, J. R. Statist. Soc. B 63, 127-146 (resample, then move).
    Chopin 2002, Biometrika 89, 539-551 (all that was observed decides on a move).
"""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from observer.resampling import log_sums, systematic_counts
from observer.shape.distance_fields import Solids
from observer.shape.felt import Felt, Look
from observer.shape.hypotheses import RANGES, Variants, reflected
from observer.shape.mode_search import AGAIN, ENOUGH, ModeSearch
from observer.shape.skin import Skin

FEWEST, MOST, REPLAYED = 1, 2, 80  # moves each time that a solid's variants are resampled: many while looks are few
AT_A_STEP = 15_000  # records held against hypotheses after which moves wait for the next step: some ten milliseconds
WORTH = 0.01  # share of the posterior below which a solid's variants are resampled and not moved; less beyond
MANY_SOLIDS = 50
FEW = 40  # variants of such a solid
FEWEST_TOUCHES = 3.0  # before modes are searched for
SOONEST, LATEST = 1.2, 2.0  # times as many before they are again: of the likeliest solid, and of one that is hopeless,
NATS_LATER = 40.0  # as much later as it is less likely, by one for so many nats
MISSED = 1.0  # nats by which modes must be better than what there is, unless so many draws are effective:
HOPELESS, LIKELY = 12.0, 5.0  # nats below all evidence: a solid is not it, or hardly
MANY, SOME = 40, 20  # draws, each time, of a solid that may be it, and of one that is hardly
FIRST_STEP, SHORTEST, LONGEST = 0.3, 0.006, 0.6  # of a range, and rad, of a move
VARIED = 0.7  # SD of the log of a step's length: short and long ones at any time
ANEW = 0.15  # of the moves: any turn at all
ACCEPTED = 0.3  # share of the moves that steps are made to have (Roberts et al. 1997)


class Rejuvenation:
    """Keeps what was felt, and moves variants by it."""

    def __init__(self, variants: Variants, skin: Skin, temper: float) -> None:
        """Begin before the first look.

        Args:
            variants: that are moved.
            skin: of the hand.
            temper: exponent of the evidence of a look.
        """
        self._variants, self._temper = variants, temper
        self._felt = Felt(skin, *variants.balls())
        self._spent = 0  # records held against hypotheses in this step
        self._fit = np.zeros(variants.hypotheses)  # the log likelihood of all looks, of each hypothesis where it now is
        solids = variants.hypotheses // variants.count
        self._worth = WORTH * min(1.0, MANY_SOLIDS / solids)
        self._step = np.full(solids, FIRST_STEP)
        self._first = np.arange(solids) * variants.count
        self._due = np.zeros(solids, dtype=np.int64)  # moves of each solid
        self._awake = np.full(solids, variants.count)
        self._search = ModeSearch(variants, temper)
        self._searched = np.zeros(solids)  # how much had been touched when modes of each were last searched for

    def take(self, look: Look, solids: Solids, log_evidence: Array) -> None:
        """Take in what was felt.

        Args:
            look: copied.
            solids: H hypotheses.
            log_evidence: (H,), to which the log likelihood of the look is added, with the exponent `temper`.
        """
        self._felt.take(look)
        awake = np.flatnonzero(log_evidence > -np.inf)
        gained, self._spent = self._felt.last(solids.of(awake), self._temper)
        log_evidence[awake] += gained
        self._fit[awake] += gained

    def resample(self, units: Array, log_evidence: Array, rng: np.random.Generator) -> set[int]:
        """Resample the variants of each solid of which fewer than half are effective; they are to be moved.

        Args:
            units: (H, 9) as of `Variants.draw`, changed.
            log_evidence: (H,), changed; the sum over a solid's variants stays.
            rng: draws.

        Returns:
            Which solids' have changed.
        """
        changed = set()
        share = self._share(log_evidence)
        wanted = np.where(share < self._worth, min(FEW, self._variants.count), self._variants.count)
        for solid, _, kept in self._variants.resampled(log_evidence, rng, self._awake, wanted):
            first = solid * self._variants.count
            mine = slice(first, first + len(kept))
            units[mine], self._fit[mine] = units[kept], self._fit[kept]
            self._awake[solid] = len(kept)
            self._due[solid] = np.clip(REPLAYED // self._felt.looks, FEWEST, MOST)
            changed.add(solid)
        return changed

    def _log_sums(self, log_evidence: Array) -> Array:
        """(K,) the log evidence of each solid."""
        sums = np.empty(len(self._due))
        log_sums(log_evidence, self._first, sums)
        return sums

    def _share(self, log_evidence: Array) -> Array:
        """(K,) the posterior of each solid."""
        of_solids = self._log_sums(log_evidence)
        return np.asarray(np.exp(of_solids - np.logaddexp.reduce(of_solids)))

    def move(self, units: Array, log_evidence: Array, rng: np.random.Generator) -> set[int]:
        """Make some of the moves that are due, those of the likeliest solids first: no step takes long.

        Args:
            units: (H, 9) as of `Variants.draw`, changed.
            log_evidence: (H,).
            rng: draws.

        Returns:
            Which solids' have moved.
        """
        changed, spent, self._spent = self._look_for_modes(units, log_evidence, rng), self._spent, 0
        if not self._due.any():
            return changed
        share = self._share(log_evidence)
        self._due[share < self._worth] = 0
        while self._due.any() and spent < AT_A_STEP:
            solid = int(np.argmax(np.where(self._due > 0, share, -1.0)))
            spent += self._metropolis(units, solid, rng)
            self._due[solid] -= 1
            changed.add(solid)
        return changed

    def _look_for_modes(self, units: Array, log_evidence: Array, rng: np.random.Generator) -> set[int]:
        """Search for modes of the one solid for which most was touched since; where its variants have missed them, draw
        them anew, and their evidence.

        Returns:
            That solid where it was so.
        """
        grown = self._felt.touched_so_far / np.maximum(self._searched, FEWEST_TOUCHES / SOONEST)
        if grown.max() < SOONEST:
            return set()
        of_solids = self._log_sums(log_evidence)
        grown /= np.minimum(SOONEST + (of_solids.max() - of_solids) / NATS_LATER, LATEST)
        solid = int(np.argmax(grown))
        if grown[solid] < 1.0:
            return set()
        self._searched[solid] = self._felt.touched_so_far
        first, awake = solid * self._variants.count, self._awake[solid]
        fit = self._fit[first : first + awake]
        evidence, there = of_solids[solid], np.logaddexp.reduce(of_solids)
        least = there - HOPELESS
        modes = self._search.modes(self._felt, solid, units[first + np.argsort(-fit)[:AGAIN]], rng, least)
        if modes.fit.max() < max(least, fit.max() - MISSED):  # no evidence is above the best fit
            return set()
        guess = max(self._search.log_evidence(solid, modes), evidence)
        if guess < least:
            return set()
        found = self._search.posterior(self._felt, solid, modes, rng, MANY if guess > there - LIKELY else SOME)
        if not found.effective >= ENOUGH and not found.log_evidence >= evidence + MISSED:
            return set()
        kept, log_weight = np.arange(len(found.units)), found.log_weight
        if len(kept) > self._variants.count:
            copies = systematic_counts(np.exp(log_weight - found.log_evidence), rng.random(), self._variants.count)
            kept = kept.repeat(copies)
            log_weight = np.full(len(kept), found.log_evidence - np.log(len(kept)))
        mine = slice(first, first + len(kept))
        units[mine], self._fit[mine], self._awake[solid] = found.units[kept], found.fit[kept], len(kept)
        log_evidence[first : first + self._variants.count] = -np.inf
        log_evidence[mine] = log_weight
        return {solid}

    def _metropolis(self, units: Array, solid: int, rng: np.random.Generator) -> int:
        """Propose one move to each variant of a solid, by steps of chance in all that is not known, and make it where
        Metropolis's rule says so.

        Returns:
            How many records were looked at.
        """
        count = self._awake[solid]
        mine = solid * self._variants.count + np.arange(count)
        step = self._step[solid] * np.exp(VARIED * rng.standard_normal((count, 1)))
        proposed = units[mine]
        proposed[:, :RANGES] = reflected(proposed[:, :RANGES] + step * rng.standard_normal((count, RANGES)))
        anew = rng.random(count) < ANEW
        proposed[:, RANGES:] = self._variants.turns.propose(proposed[:, RANGES:], step, anew, rng)
        least = self._fit[mine] + np.log(rng.random(count))
        fit, looked = self._felt.log_likelihood(self._variants.place(proposed, mine), self._temper, least)
        accepted = fit > least
        units[mine[accepted]], self._fit[mine[accepted]] = proposed[accepted], fit[accepted]
        rate = accepted[~anew].mean() if not anew.all() else ACCEPTED
        self._step[solid] = np.clip(self._step[solid] * np.exp(0.5 * (rate - ACCEPTED)), SHORTEST, LONGEST)
        return looked
