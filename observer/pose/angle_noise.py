"""What an observer believes of the felt angles, white noise apart: felt = angle + offset + white noise.

Shapes: J joints, E = J times the number of errors that last. Angles in radians, parameters in degrees.

An offset is the sum of errors that last: a bias, a drift. Each is a linear Gaussian Markov process of every joint
(`haptic_env.sensors.Lasting`), so that a filter keeps it in its state, beside the angles and velocities (Schmidt 1966,
Advances in Control Systems 3, 293-340; Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications to Tracking and
Navigation, section 8.2), and finds it out as far as anything but the felt angles tells of the pose.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from haptic_env import sensors, validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.sensors import Spread

GUESS_DEG = 3.0  # σ where it is to be found out, before anything was felt


class Offset(NamedTuple):
    """What is known of the offsets: their `mean` and `std` (J,) rad."""

    mean: Array
    std: Array

    @classmethod
    def of(cls, mean: Array, covariance: Array, kinds: Sequence[slice], joints: int) -> Offset:
        """Read them off a Gaussian.

        Args:
            mean: (S,).
            covariance: (S, S).
            kinds: where it keeps each kind of errors; none: there are no offsets.
            joints: J.

        Returns:
            The sums of all kinds.
        """
        if not kinds:
            return cls(np.zeros(joints), np.zeros(joints))
        total, variance = summed(mean, covariance, kinds)
        return cls(total.copy(), np.sqrt(np.maximum(variance, 0.0)))


class AngleNoise:
    """The errors that last (`lasting`), white noise beyond that of one σ for all, and how the start pose is known.

    `decay`, `fresh` and `prior` (E,): what a step leaves of each error, the variance that it adds, and the variance at
    the reset, rad²; one kind of error after the other, joint by joint. `start_variance` rad²: of the angles at the
    reset. `finds_sigma`: whether σ is to be found out.
    """

    def __init__(
        self,
        joints: int,
        step_seconds: float,
        *,
        bias_deg: Spread = 0.0,
        drift_deg: Spread = 0.0,
        drift_seconds: float = 10.0,
        proportional: float = 0.0,
        start_std_deg: float = 0.0,
        finds_sigma: bool = False,
    ) -> None:
        """Believe in the sensors that the environment makes of the same numbers.

        Args:
            joints: J.
            step_seconds: s, from one reading to the next.
            bias_deg: degrees, SD of the constant error of each joint and trial: one for all joints, or (J,).
            drift_deg: degrees, SD of the slow error of each joint, likewise.
            drift_seconds: s, time constant of the drift.
            proportional: SD of white noise as a fraction of the angle.
            start_std_deg: degrees, SD of each joint's angle about the rest pose at the reset.
            finds_sigma: find σ out.

        Raises:
            ValueError: for numbers out of range.
        """
        felt = sensors.Proprioception(
            [
                sensors.Bias(bias_deg, joints),
                sensors.Drift(drift_deg, drift_seconds, step_seconds, joints),
                sensors.Proportional(proportional),
            ]
        )
        self.lasting = tuple(each for each in felt.noises if isinstance(each, sensors.Lasting))
        self._white = tuple(each for each in felt.noises if not isinstance(each, sensors.Lasting))
        self.start_variance = (
            np.deg2rad(validate.number("start_std_deg", start_std_deg, 0.0, 90.0, unit="degrees")) ** 2
        )
        self.finds_sigma = finds_sigma
        self._joints = joints
        self.decay = self._of_joints([each.decay for each in self.lasting])
        self.fresh = self._of_joints([each.step_sd**2 for each in self.lasting])
        self.prior = self._of_joints([each.sd**2 for each in self.lasting])

    def _of_joints(self, of_kinds: Sequence[float | Array]) -> Array:
        """(E,): what is the same for all joints, or (J,) of each, of one kind of errors after the other."""
        return np.array([np.broadcast_to(each, self._joints) for each in of_kinds], dtype=np.float64).reshape(-1)

    @property
    def sd(self) -> float | Array:
        """Rad: SD of the offset of a joint, over trials; (J,) where joints differ."""
        total: Any = np.sqrt(sum(each.sd**2 for each in self.lasting))
        return total if np.ndim(total) else float(total)

    @property
    def is_white(self) -> bool:
        """Whether the noise is the same whatever the angles are."""
        return not self._white and not self.lasting

    def variance(self, sigma: float | Array, angles: Array, spread: Array) -> Array:
        """The variance of white noise about angles that are themselves uncertain.

        Args:
            sigma: rad, SD of what is the same for all angles; (J,) where joints differ.
            angles: (T·J,) rad, as expected, of one step or of several.
            spread: (T·J,) rad², their variance.

        Returns:
            (T·J,) rad².
        """
        if isinstance(sigma, np.ndarray):
            total = np.resize(np.square(sigma), len(angles))
        else:
            total = np.full(len(angles), sigma**2)
        for each in self._white:
            total += each.variance(np.sqrt(angles**2 + np.maximum(spread, 0.0)))  # a square in the angle
        return total

    def over_time(self, steps: int) -> Array:
        """Give the covariance of the joints' offsets at successive steps.

        Args:
            steps: T.

        Returns:
            (T·J, T·J) rad², step by step.
        """
        apart = np.abs(np.subtract.outer(np.arange(steps), np.arange(steps)))
        total = np.zeros((steps * self._joints, steps * self._joints))
        for each in self.lasting:
            total += np.kron(each.decay**apart, np.diag(np.broadcast_to(each.sd**2, self._joints)))
        return total

    def unknown(self, joints: int) -> Offset:
        """Give the offsets of which nothing is found out.

        Args:
            joints: J.

        Returns:
            Their mean and SD beforehand.
        """
        return Offset(np.zeros(joints), np.full(joints, self.sd))

    def constant(self, kinds: Sequence[slice]) -> slice:
        """Tell which of the errors never change: those of a bias, which is the first of all kinds.

        Args:
            kinds: where they are.

        Returns:
            That of the bias; an empty one without.
        """
        return kinds[0] if self.lasting and self.lasting[0].decay == 1.0 else slice(0, 0)

    def kinds(self, first: int, joints: int) -> list[slice]:
        """Where a Gaussian that keeps the errors from its number `first` on has each kind of them.

        Args:
            first: where the errors begin.
            joints: J.

        Returns:
            A slice of J numbers for each kind.
        """
        return [slice(each, each + joints) for each in range(first, first + len(self.decay), joints)]


def believed(
    joints: int,
    control_hz: float,
    sigma_deg: Spread | None,
    bias_deg: Spread,
    drift_deg: Spread,
    drift_seconds: float,
    proportional: float,
    start_std_deg: float,
) -> tuple[float | Array, AngleNoise]:
    """What an observer is told of its felt angles.

    Args:
        joints: J.
        control_hz: Hz.
        sigma_deg: degrees, SD of white noise, of all joints or (J,); None: it is to be found out.
        bias_deg: as `AngleNoise` has it, and so are the others.
        drift_deg: degrees.
        drift_seconds: s.
        proportional: a fraction.
        start_std_deg: degrees.

    Returns:
        σ, rad, to begin with, and all else.

    Raises:
        ValueError: for numbers out of range.
    """
    noise = AngleNoise(
        joints,
        1.0 / control_hz,
        bias_deg=bias_deg,
        drift_deg=drift_deg,
        drift_seconds=drift_seconds,
        proportional=proportional,
        start_std_deg=start_std_deg,
        finds_sigma=sigma_deg is None,
    )
    return sensors.White(GUESS_DEG if sigma_deg is None else sigma_deg, joints).sigma, noise


def summed(mean: Array, covariance: Array, parts: Sequence[slice]) -> tuple[Array, Array]:
    """Of a Gaussian, the sum of several parts of J numbers, joint by joint: felt angles are one of the angles and of
    each kind of error, offsets one of the errors.

    Args:
        mean: (S,).
        covariance: (S, S).
        parts: where they are.

    Returns:
        Mean and variance (J,).
    """
    if len(parts) == 1:
        return mean[parts[0]], covariance[parts[0], parts[0]].diagonal()
    total = sum((mean[part] for part in parts[1:]), mean[parts[0]])
    pairs = itertools.product(parts, parts)
    next(pairs)
    first = covariance[parts[0], parts[0]].diagonal()
    return total, sum((covariance[pair].diagonal() for pair in pairs), first)


class KeepsErrors:
    """What a filter tells of the errors that its Gaussian keeps, of the `_kinds` of its `noise`."""

    hand: Hand
    noise: AngleNoise
    mean: Array
    covariance: Array
    _kinds: Sequence[slice]
    unfound = np.zeros(0)
    needs_torque = True

    @property
    def constant(self) -> slice:
        """Where `mean` keeps the errors of the angles that never change; nowhere where it keeps none."""
        return self.noise.constant(self._kinds)

    @property
    def learns(self) -> bool:
        """Whether there are offsets that could be found out by more than the felt angles."""
        return len(self._kinds) > 0

    @property
    def offset(self) -> Offset:
        """What is known of the felt angles' offsets now."""
        return Offset.of(self.mean, self.covariance, self._kinds, self.hand.joints)

    def _expected(self) -> tuple[Array, Array]:
        """The angles (J,) rad that would be felt without white noise: mean and variance."""
        return summed(self.mean, self.covariance, [slice(0, self.hand.joints), *self._kinds])


class FollowsFelt:
    """What is told of errors where the angles are followed as they are felt: no more than is known beforehand."""

    learns, constant, needs_torque = False, slice(0, 0), False
    hand: Hand
    noise: AngleNoise

    @property
    def unfound(self) -> Array:
        """(J,) rad²: variance of constant errors that the angles, and any map made of them, have all along; or (0,)."""
        return self.noise.prior[self.noise.constant(self.noise.kinds(0, self.hand.joints))]

    @property
    def offset(self) -> Offset:
        """What is known of the felt angles' offsets: no more than beforehand."""
        return self.noise.unknown(self.hand.joints)
