"""Many interacting multiple model filters that move on together, one for each direction.

Shapes: C directions, in B blocks of W side by side; M levels, S = 3 + T numbers of a direction's state.
"""

from __future__ import annotations

from typing import Self

import numpy as np

from haptic_env.arrays import Array
from observer.pose.interacting_models import JumpMarkovModel, expect, over_levels, take_in
from observer.pose.lagged_moments import PRESENT, LaggedMoments
from observer.pose.plain_loops import WIDE


class FilterBank:
    """The filters of all directions.

    What a step does before anything is felt may be done before it, by `expect`, while there is time; else `step` does
    it. Nothing that is believed differs, not a bit, and what is kept of the bank need not tell.

    Attributes:
        level: (B, M, W) probability of each level.
        moments: `LaggedMoments` of the state at each level, B by M of W side by side.
    """

    def __init__(self, model: JumpMarkovModel, level: Array, moments: LaggedMoments, count: int) -> None:
        """Begin.

        Args:
            model: how each moves.
            level: (B, M, W).
            moments: at each level.
            count: C.
        """
        self.level, self.moments, self._count, self._model = level, moments, count, model
        self._ahead = LaggedMoments(*map(np.zeros_like, moments))
        self._log_prior, self._expected = np.zeros_like(level), False

    @classmethod
    def at_rest(
        cls, model: JumpMarkovModel, angles: Array, variance: float, present: Array, lag: int, apart: int
    ) -> Self:
        """Begin where nothing has moved before: all angles of the past are that of now.

        Args:
            model: how each moves.
            angles: (C,) rad, where they are.
            variance: rad², of that.
            present: (M, 2) variances of velocity and acceleration at each level.
            lag: T.
            apart: A.

        Returns:
            The filters.
        """
        levels, blocks = len(present), -(-len(angles) // WIDE)
        moments = LaggedMoments.zero((blocks, levels), lag, apart, WIDE)
        numbers = PRESENT + lag
        means, rows = moments.mean.reshape(blocks, levels, numbers, WIDE), moments.rows
        means[:] = _in_blocks(angles)[:, None, None]
        rows = rows.reshape(blocks, levels, PRESENT, numbers, WIDE)
        rows[:, :, 0] = variance
        moments.bands[:] = variance
        moving = np.arange(1, PRESENT)
        means[:, :, moving] = rows[:, :, 0, moving] = 0.0
        rows[:, :, moving, moving] = present[..., None]
        return cls(model, np.full((blocks, levels, WIDE), 1.0 / levels), moments, len(angles))

    def expect(self) -> None:
        """Do what the next step does before anything is felt at it."""
        if not self._expected:
            expect(self.level, self.moments, self._model, self._log_prior, self._ahead)
            self._expected = True

    def step(self, felt: Array, variance: Array) -> tuple[Array, LaggedMoments]:
        """Move on by a step, and take in what was felt.

        Args:
            felt: (C,) rad.
            variance: (C,) rad², of its noise.

        Returns:
            The log density (C,) of what was felt, given what was before, and the moments of each direction whatever its
            level.
        """
        self.expect()
        log_density, mixed = np.empty(self._count), self._room()
        take_in(self._log_prior, self._ahead, felt, variance, self.level, log_density, mixed)
        self.moments, self._ahead, self._expected = self._ahead, self.moments, False
        return log_density, mixed

    def widen(self, variance: Array) -> None:
        """Let each be less sure of where it is now.

        Args:
            variance: (C,) rad², by how much.
        """
        self.moments.rows[:, :, 0, :WIDE] += _in_blocks(variance)[:, None]
        self._expected = False  # it was of what was believed before

    def over_levels(self) -> LaggedMoments:
        """Tell of each direction whatever its level.

        Returns:
            The moments of C Gaussians.
        """
        mixed = self._room()
        over_levels(self.level, self.moments, mixed)
        return mixed

    def _room(self) -> LaggedMoments:
        _, apart, past = self.moments.bands.shape[1:]
        return LaggedMoments.zero((self._count,), past // WIDE, apart - 1)


def _in_blocks(values: Array) -> Array:
    """Of values (C,) those of each block (B, W), the last one filled up with zeros."""
    blocks = -(-len(values) // WIDE)
    result = np.zeros(blocks * WIDE)
    result[: len(values)] = values
    return result.reshape(blocks, WIDE)
