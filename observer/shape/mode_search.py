"""Where a solid would have to lie to have been felt: found from the touches themselves, and what that is worth.

Shapes: M modes, D draws. Lengths in metres.

Samples that were drawn before anything was felt may all be far from every place where a solid explains what was felt;
its evidence is then that of a bad fit. So starts of any turn are registered to the touches
(`observer.shape.registration`), and those that fit best are modes of the posterior. Draws about the modes, weighted by
what they explain of all that was felt and by how improbably they were drawn, are the posterior; the mean of their
weights is its evidence.

References:
    Owen & Zhou 2000, J. Am. Stat. Assoc. 95, 135-143 (importance sampling from a mixture, with a defensive part).
    Tierney & Kadane 1986, J. Am. Stat. Assoc. 81, 82-86 (Gaussians about the modes).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import logsumexp

from haptic_env.arrays import Array
from observer.resampling import normalise
from observer.shape.felt import Felt
from observer.shape.hypotheses import RANGES, Variants
from observer.shape.registration import UNKNOWNS, Touched, register

STARTS, AGAIN = 64, 4  # turns at random, and variants there are that explain most
FEW_STEPS, PROMISING, MANY_STEPS = 3, 8, 12  # how far all starts are moved, and how many of them on
MODES = 8
NEWER = 1.03  # times as much touched as when it was last put into the world
APART = 0.003, 0.2  # m and rad by which modes differ
WIDER = 1.2  # times as wide as the touches say, lest the tails be missed
WIDEST_TURN = 0.7  # rad, SD about each axis; wider ones go around
ANY_TURN = 0.25  # of the draws about modes: any turn at all, as of what is round
ANYWHERE = 0.1  # of the draws: as if nothing had been felt, so that no weight is beyond bounds
WORSE = 12.0  # nats below the best mode, what does not matter any more
SIZE_AND_PLACE = np.array([0, 2, 3, 4])  # of the units of a variant


class Modes(NamedTuple):
    """Where a solid explains what was felt.

    Attributes:
        units: (M, 9) as of `Variants.draw`.
        spread: (M, 7, 7) covariances of size and place in units and of a turn in rad, with which touches leave them.
        fit: (M,) log likelihood of all that was felt.
    """

    units: Array
    spread: Array
    fit: Array


class Found(NamedTuple):
    """The posterior of one solid.

    Attributes:
        units: (D, 9) as of `Variants.draw`.
        log_weight: (D,) log of weights, whose sum is the evidence.
        fit: (D,) log likelihood of all that was felt.
        log_evidence: of the solid; no number where no draw explains anything.
        effective: how many draws matter; likewise.
    """

    units: Array
    log_weight: Array
    fit: Array
    log_evidence: float
    effective: float


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
        self._touched: Touched
        self._so_far = 0.0

    def modes(self, felt: Felt, solid: int, known: Array, rng: np.random.Generator) -> Modes:
        """Find where a solid explains what was felt.

        Args:
            felt: all of it.
            solid: index.
            known: (A, 9) units of variants to begin with, besides those of any turn.
            rng: draws.

        Returns:
            At most `MODES` of them.
        """
        count = STARTS + len(known)
        units = np.zeros((count, RANGES + 4))
        units[:STARTS, SIZE_AND_PLACE] = rng.uniform(-0.5, 0.5, (STARTS, 4)) * self._free[:4]
        units[:STARTS, RANGES:] = self._variants.turns.draw(STARTS, rng)
        units[STARTS:] = known
        starts = self._variants.place(units, np.full(count, solid * self._variants.count))
        touched, bounds = self._felt_by_now(felt, rng), self._variants.bounds(solid)
        cost, information = np.empty(count), np.empty((count, UNKNOWNS, UNKNOWNS))
        register(starts, touched, bounds, FEW_STEPS, cost, information)
        promising = np.argsort(cost, kind="stable")[:PROMISING]
        starts, cost, information = starts.of(promising), cost[promising], information[promising]
        register(starts, touched, bounds, MANY_STEPS, cost, information)
        units = self._variants.units_of(starts, solid)
        kept: list[int] = []
        turns = Rotation.from_quat(units[:, RANGES:])
        for i in np.argsort(cost, kind="stable"):
            apart = np.linalg.norm(starts.position[kept] - starts.position[i], axis=1) > APART[0]
            turned = np.array([(turns[i] * turns[k].inv()).magnitude() for k in kept]) > APART[1]
            if np.all(apart | turned):
                kept.append(int(i))
            if len(kept) == MODES:
                break
        fit, _ = felt.log_likelihood(starts.of(np.array(kept)), self._temper)
        return Modes(units[kept], self._spread(information[kept], units[kept]), fit)

    def _felt_by_now(self, felt: Felt, rng: np.random.Generator) -> Touched:
        """What was touched, made anew only where that has become more since."""
        if felt.touched_so_far > NEWER * self._so_far:
            self._touched, self._so_far = felt.touched(self._temper, rng), felt.touched_so_far
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

    def posterior(self, felt: Felt, solid: int, modes: Modes, rng: np.random.Generator, draws: int) -> Found:
        """Sample the posterior of one solid.

        Args:
            felt: all that was.
            solid: index.
            modes: of it.
            rng: draws.
            draws: D.

        Returns:
            The draws with their weights.
        """
        at, spread, fit = modes
        share = np.exp(0.5 * (fit - fit.max()))
        share /= share.sum()
        of = rng.choice(len(at), draws, p=share)
        factor = np.linalg.cholesky(spread + 1e-12 * np.eye(UNKNOWNS))
        off = np.einsum("dij,dj->di", factor[of], rng.standard_normal((draws, UNKNOWNS)))
        units = at[of]
        units[:, SIZE_AND_PLACE] += off[:, :4] * self._free[:4]
        blind = rng.random(draws) < ANYWHERE
        drawn = rng.uniform(-1.0, 1.0, (draws, 4)) * self._free[:4]
        units[:, SIZE_AND_PLACE] = np.where(blind[:, None], drawn, units[:, SIZE_AND_PLACE])
        anew = blind | (rng.random(draws) < ANY_TURN)
        turns = Rotation.from_rotvec(off[:, 4:]) * Rotation.from_quat(units[:, RANGES:])
        units[:, RANGES:] = np.where(anew[:, None], self._variants.turns.draw(draws, rng), turns.as_quat())
        inside = np.all(np.abs(units[:, SIZE_AND_PLACE]) <= 1.0, axis=1) & self._variants.turns.allowed(
            units[:, RANGES:]
        )
        log_weight, explained = np.full(draws, -np.inf), np.full(draws, -np.inf)
        mine = np.full(draws, solid * self._variants.count)[inside]
        least = np.full(len(mine), fit.max() - WORSE)
        explained[inside], _ = felt.log_likelihood(self._variants.place(units[inside], mine), self._temper, least)
        proposed = self._log_proposal(units[inside], at, spread, share)
        log_weight[inside] = explained[inside] + self._log_prior() - proposed - np.log(draws)
        log_evidence, _, effective = normalise(log_weight.copy())
        return Found(units, log_weight, explained, log_evidence, effective)

    def _log_prior(self) -> float:
        """The log density of any size and place, in units, and of any turn, by the share of all turns."""
        return float(-np.log(2.0) * self._free[:4].sum() - np.log(self._variants.turns.share))

    def _log_proposal(self, units: Array, modes: Array, spread: Array, share: Array) -> Array:
        """(D,) log density with which `posterior` draws, in the measure of `_log_prior`."""
        parts = [np.full(len(units), self._log_prior() + np.log(ANYWHERE))]
        place = np.flatnonzero(self._free[:4])
        every = np.append(place, [4, 5, 6])
        for mode, wide, much in zip(modes, spread, share, strict=True):
            turn = (Rotation.from_quat(units[:, RANGES:]) * Rotation.from_quat(mode[RANGES:]).inv()).as_rotvec()
            off = np.concatenate([(units - mode)[:, SIZE_AND_PLACE], turn], axis=1)
            about = _log_normal(off[:, every], wide[np.ix_(every, every)]) - _log_of_turns(turn)
            any_turn = _log_normal(off[:, place], wide[np.ix_(place, place)]) - np.log(self._variants.turns.share)
            much *= 1.0 - ANYWHERE
            parts += [about + np.log(much * (1 - ANY_TURN)), any_turn + np.log(much * ANY_TURN)]
        return np.asarray(logsumexp(parts, axis=0))


def _log_normal(off: Array, covariance: Array) -> Array:
    """(D,) log density of a normal about 0 of (k, k)."""
    factor = np.linalg.cholesky(covariance + 1e-12 * np.eye(len(covariance)))
    scaled = np.linalg.solve(factor, off.T)
    return np.asarray(
        -0.5 * (scaled**2).sum(axis=0) - np.log(np.diag(factor)).sum() - 0.5 * len(covariance) * np.log(2.0 * np.pi)
    )


def _log_of_turns(turn: Array) -> Array:
    """(D,) log of the share of all turns in a unit of volume of rotation vectors (D, 3), which is largest about 0."""
    angle = np.maximum(np.linalg.norm(turn, axis=1), 1e-6)
    return np.asarray(np.log(2.0 * (1.0 - np.cos(angle)) / angle**2) - np.log(8.0 * np.pi**2))
