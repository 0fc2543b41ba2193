"""Where a solid would have to lie to have been felt: found from the touches themselves, and what that is worth.

Shapes: M modes, D draws. Lengths in metres.

Samples that were drawn before anything was felt may all be far from every place where a solid explains what was felt;
its evidence is then that of a bad fit. So starts of any turn are registered to the touches
(`observer.shape.registration`), and those that fit best are modes of the posterior. Draws about the modes and their
copies by symmetry (`observer.shape.symmetry`), weighted by what they explain of all that was felt and by how improbably
they were drawn, are the posterior; the mean of their weights is its evidence. They are made in stages: the best of
those before are modes too.

References:
    Cornuet et al. 2012, Scand. J. Stat. 39, 798-812 (stages of importance sampling, each weighted by all).
    Owen & Zhou 2000, J. Am. Stat. Assoc. 95, 135-143 (importance sampling from a mixture, with a defensive part).
    Tierney & Kadane 1986, J. Am. Stat. Assoc. 81, 82-86 (Gaussians about the modes).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import logsumexp

from haptic_env.arrays import Array
from observer.resampling import normalise
from observer.shape.distance_fields import Solids
from observer.shape.felt import Felt
from observer.shape.hypotheses import RANGES, Variants
from observer.shape.modes import Found, Modes, log_mixture, shares
from observer.shape.registration import UNKNOWNS, Touched, register
from observer.shape.turns import angle, product

GLANCED_AT, AT_PATCHES, AT_LOOKS = 1024, 16, 24  # starts at random that are moved by one step, for so little of all
STARTS, AGAIN = 48, 4  # that look best by that, and variants there are that explain most
FEW_STEPS, PROMISING, MANY_STEPS = 3, 8, 8  # how far all starts are moved, and how many of them on
AS_KNOWN = 2  # variants that are not moved by that
REFINED, REFINING = 4, 6  # of these, how many are moved by all that was felt, and how far
MODES, LOOKED_AT, MOST_COPIES = 4, 16, 64  # of the best, so many that lie apart, and with their copies
NEWER = 1.03  # times as much touched as when it was last put into the world
APART = 0.003, 0.2  # m and rad by which modes differ
APART_UNITS = 0.15  # of a range, by which draws do that are modes of the next stage
STAGES, ENOUGH = 4, 5.0  # of draws, at most, and how many of these are to be effective
WIDER = 1.2  # times as wide as the touches say, lest the tails be missed
WIDEST_TURN = 0.7  # rad, SD about each axis; wider ones go around
ANY_TURN = 0.25  # of the draws about modes: any turn at all, as of what is round
ANYWHERE = 0.1  # of the draws: as if nothing had been felt, so that no weight is beyond bounds
WORSE = 12.0  # nats below the best mode, what does not matter any more
SIZE_AND_PLACE = np.array([0, 2, 3, 4])  # of the units of a variant


class ModeSearch:
    """Searches the posterior of one solid."""

    def __init__(self, variants: Variants, temper: float) -> None:
        """Take what is not known.

        Args:
            variants: of all solids.
            temper: exponent of what was felt.
        """
        self._variants, self._temper = variants, temper
        self._ranges = variants.ranges[SIZE_AND_PLACE]
        self._free = np.append(self._ranges > 0.0, [True] * 3)
        self._touched: tuple[Touched, Touched, Touched]
        self._so_far = 0.0

    def modes(self, felt: Felt, solid: int, known: Array, rng: np.random.Generator, least: float = -np.inf) -> Modes:
        """Find where a solid explains what was felt.

        Args:
            felt: all of it.
            solid: index.
            known: (A, 9) units of variants to begin with, besides those of any turn.
            rng: draws.
            least: log likelihood below which none is looked at more closely.

        Returns:
            At most `MODES` of them, one of those that symmetry makes of each.
        """
        (glance, few, every), bounds = self._felt_by_now(felt, rng), self._variants.bounds(solid)
        units = np.zeros((GLANCED_AT, RANGES + 4))
        units[:, SIZE_AND_PLACE] = rng.uniform(-0.5, 0.5, (GLANCED_AT, 4)) * self._free[:4]
        units[:, RANGES:] = self._variants.turns.draw(GLANCED_AT, rng)
        mine = np.full(GLANCED_AT, solid * self._variants.count)
        starts = self._variants.place(units, mine)
        cost, information = np.empty(GLANCED_AT), np.empty((GLANCED_AT, UNKNOWNS, UNKNOWNS))
        register(starts, glance, bounds, 1, cost, information)
        best = np.argsort(cost, kind="stable")[:STARTS]
        starts = starts.of(best).and_of(self._variants.place(known, mine[: len(known)]))
        count = STARTS + len(known)
        cost, information = np.empty(count), np.empty((count, UNKNOWNS, UNKNOWNS))
        as_known = starts.of(np.arange(STARTS, min(STARTS + AS_KNOWN, count)))
        register(starts, few, bounds, FEW_STEPS, cost, information)
        promising = np.argsort(cost, kind="stable")[:PROMISING]
        starts, cost, information = starts.of(promising), cost[promising], information[promising]
        register(starts, few, bounds, MANY_STEPS, cost, information)
        starts = starts.of(self._apart(starts, cost, REFINED)).and_of(as_known)
        cost, information = np.empty(len(starts.scale)), np.empty((len(starts.scale), UNKNOWNS, UNKNOWNS))
        register(starts, every, bounds, 0, cost, information)
        best = np.argsort(cost, kind="stable")[:REFINED]
        starts, cost, information = starts.of(best), cost[best], information[best]
        register(starts, every, bounds, REFINING if -0.5 * cost[0] > least else 0, cost, information)
        units, kept = self._variants.units_of(starts, solid), self._apart(starts, cost, REFINED)
        fit, _ = felt.log_likelihood(starts.of(kept), self._temper)
        return self._different(Modes(units[kept], self._spread(information[kept], units[kept]), fit), solid)

    def _different(self, modes: Modes, solid: int) -> Modes:
        """At most `MODES` that explain most and lie apart, also from the copies of others by symmetry."""
        best = np.argsort(-modes.fit, kind="stable")[:LOOKED_AT]
        best = best[modes.fit[best] > modes.fit.max() - WORSE]
        places, turns, alike = modes.units[:, SIZE_AND_PLACE], modes.units[:, RANGES:], self._variants.alike[solid]
        kept: list[tuple[int, Array]] = []
        for each in best:
            for other, copies in kept:
                near = np.abs(places[other] - places[each]).max() <= APART_UNITS
                if near and angle(np.abs(copies @ turns[each]).max()) <= APART[1]:
                    break
            else:
                kept.append((int(each), product(turns[each], alike)))
            if len(kept) == min(MODES, max(1, MOST_COPIES // len(alike))):
                break
        return modes.of(np.array([each for each, _ in kept]))

    def _copied(self, modes: Modes, solid: int) -> tuple[Modes, NDArray[np.int64]]:
        """Modes with all their copies by the symmetries of the solid, and of which (M,) each is one."""
        alike = self._variants.alike[solid]
        of = np.arange(len(modes.fit)).repeat(len(alike))
        copies = modes.of(of)
        copies.units[:, RANGES:] = product(copies.units[:, RANGES:], np.tile(alike, (len(modes.fit), 1)))
        possible = self._variants.turns.allowed(copies.units[:, RANGES:])
        possible[:: len(alike)] = True  # it was found there
        return copies.of(np.flatnonzero(possible)), of[possible]

    def _apart(self, starts: Solids, cost: Array, most: int) -> NDArray[np.int64]:
        """Which starts explain most, at most so many, and lie apart."""
        kept: list[int] = []
        turns, near = starts.rotation.reshape(-1, 9), 1.0 + 2.0 * np.cos(APART[1])  # a trace
        for i in np.argsort(cost, kind="stable"):
            apart = np.linalg.norm(starts.position[kept] - starts.position[i], axis=1) > APART[0]
            if np.all(apart | (turns[kept] @ turns[i] < near)):
                kept.append(int(i))
            if len(kept) == most:
                break
        return np.array(kept)

    def _felt_by_now(self, felt: Felt, rng: np.random.Generator) -> tuple[Touched, Touched, Touched]:
        """What was touched, a little of it, more and all; made anew only where that has become more since."""
        if felt.touched_so_far > NEWER * self._so_far:
            few, every = felt.touched(self._temper, rng)
            self._touched, self._so_far = (few.sparse(AT_PATCHES, AT_LOOKS), few, every), felt.touched_so_far
        return self._touched

    def _spread(self, information: Array, units: Array) -> Array:
        """(M, 7, 7) covariances of size and place in units and of a turn in rad; 0 of what is known."""
        by = np.ones((len(units), UNKNOWNS))
        by[:, 0] = self._ranges[0] / (1.0 + self._ranges[0] * units[:, 0])
        by[:, 1:4] = self._ranges[1:]
        information = information * by[:, :, None] * by[:, None, :]
        information += np.diag([3.0] * 4 + [1.0 / WIDEST_TURN**2] * 3)
        spread = WIDER**2 * np.linalg.inv(information)
        return np.asarray(spread * (self._free[:, None] & self._free))

    def log_evidence(self, solid: int, modes: Modes) -> float:
        """Guess the evidence of a solid from Gaussians about its modes, which decides only how closely it is looked at.

        The prior counts twice, as its bounds and as a curvature, and edges count as curves: what is sampled afterwards
        is 1.1 nats above it in the median (5 to 95 %: -1.4 to 3.2, 710 searches, tuning seeds).

        Args:
            solid: index.
            modes: of it.

        Returns:
            Its log.
        """
        free = np.flatnonzero(self._free)
        _, log_det = np.linalg.slogdet(modes.spread[:, free[:, None], free] / WIDER**2)
        volume = 0.5 * (log_det + len(free) * np.log(2.0 * np.pi)) - np.log(8.0 * np.pi**2)
        return float(logsumexp(modes.fit + volume) + self._log_prior() + np.log(len(self._variants.alike[solid])))

    def posterior(self, felt: Felt, solid: int, modes: Modes, rng: np.random.Generator, draws: int) -> Found:
        """Sample the posterior of one solid, in stages, until enough draws matter: what was drawn tells where to draw
        next.

        Args:
            felt: all that was.
            solid: index.
            modes: of it.
            rng: draws.
            draws: of a stage.

        Returns:
            The draws with their weights, those of two to `STAGES` stages.
        """
        asked: list[tuple[Modes, Array]] = []
        every: list[Array] = []
        explained: list[Array] = []
        while True:
            copies, of = self._copied(modes, solid)
            asked.append((copies, shares(copies.fit)))
            units, about = self._drawn(*asked[-1], rng, draws)
            every.append(units)
            explained.append(self._explained(felt, solid, units, modes.fit.max() - WORSE))
            if len(asked) > 1:
                found = self._weighed(np.concatenate(every), np.concatenate(explained), asked)
                if found.effective >= ENOUGH or len(asked) == STAGES:
                    return found
            drawn = units, modes.spread[of[about]], explained[-1]
            modes = self._different(Modes(*(np.concatenate(pair) for pair in zip(modes, drawn, strict=True))), solid)

    def _weighed(self, units: Array, fit: Array, asked: list[tuple[Modes, Array]]) -> Found:
        """The posterior of draws that were made about some modes with shares (M,), as many as about any others."""
        log_weight, inside = np.full(len(units), -np.inf), fit > -np.inf
        proposed = np.logaddexp.reduce([self._log_proposal(units[inside], *about) for about in asked])
        proposed -= np.log(len(asked))
        log_weight[inside] = fit[inside] + self._log_prior() - proposed - np.log(len(units))
        log_evidence, _, effective = normalise(log_weight.copy())
        return Found(units, log_weight, fit, log_evidence, effective)

    def _drawn(
        self, modes: Modes, share: Array, rng: np.random.Generator, draws: int
    ) -> tuple[Array, NDArray[np.int64]]:
        """Draws (D, 9) about modes with a `share` (M,) each, and about which (D,)."""
        of = rng.choice(len(share), draws, p=share)
        factor = np.linalg.cholesky(modes.spread + 1e-12 * np.eye(UNKNOWNS))
        off = np.einsum("dij,dj->di", factor[of], rng.standard_normal((draws, UNKNOWNS)))
        units = modes.units[of]
        units[:, SIZE_AND_PLACE] += off[:, :4] * self._free[:4]
        blind = rng.random(draws) < ANYWHERE
        drawn = rng.uniform(-1.0, 1.0, (draws, 4)) * self._free[:4]
        units[:, SIZE_AND_PLACE] = np.where(blind[:, None], drawn, units[:, SIZE_AND_PLACE])
        anew = blind | (rng.random(draws) < ANY_TURN)
        turns = product(Rotation.from_rotvec(off[:, 4:]).as_quat(), units[:, RANGES:])
        units[:, RANGES:] = np.where(anew[:, None], self._variants.turns.draw(draws, rng), turns)
        return units, of

    def _explained(self, felt: Felt, solid: int, units: Array, least: float) -> Array:
        """(D,) log likelihood of all that was felt; -inf where it is below `least`, or beyond what may be."""
        inside = np.all(np.abs(units[:, SIZE_AND_PLACE]) <= 1.0, axis=1)
        inside &= self._variants.turns.allowed(units[:, RANGES:])
        mine = np.full(np.count_nonzero(inside), solid * self._variants.count)
        explained = np.full(len(units), -np.inf)
        placed = self._variants.place(units[inside], mine)
        explained[inside], _ = felt.log_likelihood(placed, self._temper, np.full(len(mine), least))
        return explained

    def _log_prior(self) -> float:
        """The log density of any size and place, in units, and of any turn, by the share of all turns."""
        return float(-np.log(2.0) * self._free[:4].sum() - np.log(self._variants.turns.share))

    def _log_proposal(self, units: Array, modes: Modes, share: Array) -> Array:
        """(D,) log density with which draws are made about modes, in the measure of `_log_prior`."""
        free = np.flatnonzero(self._free)
        covariance = modes.spread[:, free[:, None], free] + 1e-12 * np.eye(len(free))
        much = np.log(share * (1.0 - ANYWHERE))
        any_turn = much + np.log(ANY_TURN) - np.log(self._variants.turns.share)
        log_share = np.stack([much + np.log(1.0 - ANY_TURN), any_turn], axis=1)
        out, factor, place = np.empty(len(units)), np.linalg.cholesky(covariance), SIZE_AND_PLACE[self._free[:4]]
        log_mixture(units, modes.units, factor, place, log_share, self._log_prior() + np.log(ANYWHERE), out)
        return out
