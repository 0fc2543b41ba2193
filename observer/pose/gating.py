"""Felt angles that no hand can have: a joint that wraps by whole turns, a spike.

Shapes: J joints, H joints that are heard, S numbers of a Gaussian's state.

A filter takes every reading for one with Gaussian noise, so that a single one far away throws it off for good. Such a
reading is set aside, as if that joint had not been felt at that step; one that whole turns bring to where the joint may
be is taken without them. Both are counted and, once a trial, said. Where no reading is odd nothing changes, not a bit.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import GIVEN, inner
from haptic_env.hand import Hand

TURN = 2.0 * np.pi
BEYOND = 2.0  # rad beyond a joint's limits, where hands fitted to markers are up to 1.1 rad beyond them
BEYOND_SDS = 5.0  # or as many SDs of the noise
TURNED = 0.35  # the same, of a reading without whole turns
LOST = 3.5  # the same, of what a filter makes of readings that may be
FASTEST = 40.0  # rad/s: recorded fingers turn at up to 30
JUMP, JUMP_SDS = 0.5, 8.0  # rad beyond that from where the joint is expected, and as many SDs
LEAST_SIGMA = 1e-5  # rad: of exact angles a variance of zero would make an update singular
MOST = 1e6  # rad²: of an angle's variance
IN_A_ROW = 5  # readings that agree with each other: the next one is believed, for then the filter is wrong


class Heard(NamedTuple):
    """What is left of a step with odd readings.

    Attributes:
        angles: (J,) rad, without whole turns.
        joints: (H,) those that are heard.
        anew: (J,) those of which the filter was wrong.
    """

    angles: Array
    joints: NDArray[np.int64]
    anew: NDArray[np.bool_]


class Range(NamedTuple):
    """Where angles may lie.

    Attributes:
        low: (J,) rad.
        high: (J,) rad.
    """

    low: Array
    high: Array

    def has(self, angles: Array) -> NDArray[np.bool_]:
        """Tell which angles lie in it.

        Args:
            angles: (J,) rad.

        Returns:
            (J,).
        """
        return (angles >= self.low) & (angles <= self.high)


class Gated:
    """What a filter of the pose has of the gate that its readings pass."""

    _gate: Gate

    @property
    def sigma(self) -> float | Array:
        """Rad: SD of the noise of the felt angles, (J,) where joints differ; may be set, from the next step on."""
        return self._gate.sigma

    @sigma.setter
    def sigma(self, sigma: float | Array) -> None:
        self._gate.sigma = sigma

    @property
    def set_aside(self) -> NDArray[np.int64]:
        """(J,) readings of the trial that no hand can give."""
        return self._gate.set_aside.copy()


class Gate:
    """Tells the readings that a hand can give from those that it cannot.

    Attributes:
        set_aside: (J,) the odd ones of a trial.
    """

    def __init__(self, hand: Hand, sigma: float | Array, step_seconds: float, offset: float | Array = 0.0) -> None:
        """Start a trial.

        Args:
            hand: with J joints.
            sigma: rad, SD of the noise of a reading, of all joints or (J,).
            step_seconds: s, from one reading to the next.
            offset: rad, SD of how far readings lie from the angles for good, likewise.
        """
        self._offset = BEYOND_SDS * offset  # how far felt angles may lie from the true ones for good
        self._names, self._couplings = hand.joint_names, hand.couplings
        self._jump = JUMP + FASTEST * step_seconds
        self._limits = hand.joint_limits.T
        limited = hand.model.jnt_limited.astype(bool)
        self._between = np.where(limited, self._limits, [[-np.inf], [np.inf]])
        self._middle = np.where(limited, self._limits.mean(axis=0), 0.0)
        self.sigma = sigma
        self.reset()

    @property
    def sigma(self) -> float | Array:
        """Rad: SD of the noise of a reading, (J,) where joints differ."""
        return self._sigma

    @sigma.setter
    def sigma(self, sigma: float | Array) -> None:
        self._sigma = _at_least(LEAST_SIGMA, sigma)
        low, high = self._between
        margins = (_at_least(each, BEYOND_SDS * self._sigma) + self._offset for each in (BEYOND, TURNED, LOST))
        self._possible, self._turned, self._lost_beyond = (Range(low - each, high + each) for each in margins)

    @property
    def bounds(self) -> tuple[float, Array, Array, Array, Array]:
        """What `usual_step.Gates` has."""
        return self._jump, *self._possible, *self._lost_beyond

    def pass_by(self) -> None:
        """Take note of a step without odd readings."""
        self._row[:] = 0

    def reset(self) -> None:
        """Start a trial."""
        joints = len(self._names)
        self.set_aside = np.zeros(joints, dtype=np.int64)
        self._row = np.zeros(joints, dtype=np.int64)  # odd readings, the last included, that agree with each other
        self._last = np.zeros(joints)

    def judge(self, felt: Array, expected: Array, variance: Array) -> Heard | None:
        """Tell what to make of a step's readings.

        Args:
            felt: (J,) rad; NaN where a joint was not measured, which is no odd reading, but none.
            expected: (J,) rad, by the filter.
            variance: (J,) rad², of what is expected, noise not included.

        Returns:
            What is left of them; None: all is as usual.
        """
        if self._couplings:
            felt = self._couplings.own(felt)
        if _usual(felt, expected, self._jump, *self._possible):
            self._row[:] = 0
            return None
        missing = np.isnan(felt)
        deviation = JUMP_SDS * np.sqrt(np.maximum(variance, 0.0) + self._sigma**2)
        reach = np.maximum(self._jump, deviation)
        odd = ~missing & (~self._possible.has(felt) | (np.abs(felt - expected) > reach))
        if not odd.any():
            self._row[:] = 0
            return Heard(felt, np.flatnonzero(~missing), missing & False) if missing.any() else None
        turned = felt - TURN * np.round((felt - expected) / TURN)
        near = np.maximum(JUMP, deviation)  # whole turns leave no more: a spike is rarely of them
        aside = odd & (~self._turned.has(turned) | (np.abs(turned - expected) > near))
        angles = np.where(odd & ~aside, turned, felt)
        anew = self._persist(felt, aside)
        if not self.set_aside.any():
            self._say(felt, expected, odd)
        self.set_aside += odd & ~anew
        return Heard(angles, np.flatnonzero((~aside | anew) & ~missing), anew)

    def at_first(self, felt: Array) -> Array | None:
        """Take whole turns off the readings of a reset.

        Args:
            felt: (J,) rad.

        Returns:
            (J,) rad; None where that is no pose of the hand.
        """
        usual = self._possible.has(felt)
        turned = felt - TURN * np.round((felt - self._middle) / TURN)
        return np.where(usual, felt, turned) if (usual | self._turned.has(turned)).all() else None

    def lost(self, mean: Array, covariance: Array, past: int) -> bool:
        """Tell whether a Gaussian is none of poses of the hand: what was felt has broken its arithmetic. Warns if so.

        Args:
            mean: (S,), its first J numbers being the present angles, rad.
            covariance: (S, S).
            past: from where on all are angles of the past, J by J.

        Returns:
            Whether it is lost.
        """
        if _sound(mean, covariance, past, *self._lost_beyond):
            return False
        warnings.warn(
            "the filter of the pose was lost in what was felt, and begins anew at it: no hand moves like that, or its "
            "noise is not what the observer was told",
            RuntimeWarning,
            stacklevel=4,
        )
        return True

    def at_last(self, mean: Array, felt: Array) -> Array:
        """Find angles to begin anew with.

        Args:
            mean: (J,) rad, of the filter that was lost.
            felt: (J,) rad.

        Returns:
            (J,) rad: those felt where they are possible, else those of the mean or of the middle of the joint, all no
            farther from the joint's limits than noise may be.
        """
        here = np.where(np.isfinite(mean), mean, self._middle)
        return np.where(self._possible.has(felt), felt, here).clip(*self._turned)

    def _persist(self, felt: Array, aside: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(J,) joints of which the filter must be wrong: odd readings `felt`, set `aside`, that agree for so long."""
        agree = np.abs(felt - self._last) <= self._jump
        self._row = np.where(aside & self._possible.has(felt), np.where(agree, self._row, 0) + 1, 0)
        self._last = felt
        anew = self._row > IN_A_ROW
        self._row[anew] = 0
        return np.asarray(anew)

    def _say(self, felt: Array, expected: Array, odd: NDArray[np.bool_]) -> None:
        joint = int(np.argmax(odd))
        low, high = (each[joint] for each in self._limits)
        warnings.warn(
            f"joint {self._names[joint]!r} was felt at {felt[joint]:.4g} rad, where it cannot be (it turns from "
            f"{low:.4g} to {high:.4g} rad, and is about {expected[joint]:.4g} rad): such readings are taken without "
            "whole turns, or set aside; `set_aside` counts them",
            RuntimeWarning,
            stacklevel=5,
        )


def _at_least(least: float, value: float | Array) -> float | Array:
    """The larger of both, joint by joint where there is one of each."""
    return np.maximum(value, least) if isinstance(value, np.ndarray) else max(value, least)


@inner(types.boolean(GIVEN, GIVEN, types.float64, GIVEN, GIVEN))
def _usual(felt: Array, expected: Array, jump: float, low: Array, high: Array) -> bool:
    """Whether all of `felt` (J,) lie within `jump` of `expected` (J,) and between `low` and `high` (J,)."""
    usual = True
    for j in range(len(felt)):
        usual &= abs(felt[j] - expected[j]) <= jump and low[j] <= felt[j] <= high[j]
    return usual


@inner(types.boolean(GIVEN, types.Array(types.float64, 2, "A", readonly=True), types.int64, GIVEN, GIVEN))
def _sound(mean: Array, covariance: Array, past: int, low: Array, high: Array) -> bool:
    """Whether angles, the first J and those of the `past`, lie from `low` to `high` (J,), and variances are some."""
    joints = len(low)
    sound = True
    for i in range(len(mean)):
        if i < joints or i >= past:
            sound &= low[i % joints] <= mean[i] <= high[i % joints] and covariance[i, i] <= MOST
        sound &= 0.0 <= covariance[i, i] < np.inf
    return sound


def take_in(mean: Array, covariance: Array, heard: Heard, variance: Array, kinds: Sequence[slice] = ()) -> float:
    """Condition a Gaussian on what some of the joints were felt at.

    Args:
        mean: (S,), changed; its first J numbers are the present angles, rad.
        covariance: (S, S), changed.
        heard: the readings, and of which joints.
        variance: (J,) rad², of white noise.
        kinds: where it keeps each kind of errors that last, J numbers each.

    Returns:
        The log density of what is heard.
    """
    for joint in np.flatnonzero(heard.anew):
        covariance[joint, joint] += (heard.angles[joint] - mean[joint]) ** 2
    joints = heard.joints
    parts = [joints, *(joints + kind.start for kind in kinds)]
    residual = heard.angles[joints] - sum(mean[part] for part in parts)
    with_felt = np.sum([covariance[part] for part in parts], axis=0)  # (H, S)
    total = np.sum([with_felt[:, part] for part in parts], axis=0) + np.diag(variance[joints])
    fused = np.linalg.solve(total, with_felt).T  # (S, H)
    mean += fused @ residual
    covariance -= fused @ with_felt
    covariance[:] = 0.5 * (covariance + covariance.T)
    square = residual @ np.linalg.solve(total, residual)
    return -0.5 * float(square + np.linalg.slogdet(2.0 * np.pi * total)[1])
