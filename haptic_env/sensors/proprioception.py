"""Noise of the felt joint angles: q̃ = q + ε (paper, section 3), and what real proprioception adds to it.

Shapes: J joints. Angles in radians; parameters in degrees, as people report them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import readable, validate
from haptic_env.sensors.gaussian import log_normal

Rng = np.random.Generator
Angles = NDArray[np.float64]
LARGEST = 1e9  # rad
Spread = float | Sequence[float] | NDArray[np.float64]
"""An SD, of all joints, or (J,) one of each."""


class Noise(ABC):
    """One additive source of noise on the joint angles.

    Attributes:
        joints: how many it tells apart.
    """

    joints: int = 1

    __repr__ = readable.line

    def reset(self, rng: Rng, joints: int) -> None:  # noqa: B027 - white noise has no state to draw
        """Draw the state that lasts for an episode.

        Args:
            rng: gives the draws.
            joints: J.
        """

    @abstractmethod
    def sample(self, rng: Rng, joint_angles: Angles) -> Angles:
        """Draw the error of this step.

        Args:
            rng: gives the draws.
            joint_angles: (J,) rad, the true ones.

        Returns:
            (J,) rad, to add to them.
        """

    @abstractmethod
    def variance(self, joint_angles: Angles) -> Angles:
        """Give the variance of the error at one step, whatever happened before.

        Args:
            joint_angles: (J,) rad, the true ones.

        Returns:
            (J,) rad².
        """


class Lasting(Noise):
    """An error that lasts, as a Markov process of each joint: N(0, `sd`²) at the reset, then `decay` times what it was
    and N(0, `step_sd`²) at each step; rad.

    An observer that is told of it keeps it in its state (`observer.pose.angle_noise`).
    """

    sd: float | Angles
    decay: float
    step_sd: float | Angles
    value: Angles
    sampled: Angles
    """(J,) rad: the error of the last sample, and before it of the first."""

    def reset(self, rng: Rng, joints: int) -> None:
        self.value = self.sampled = self.sd * rng.standard_normal(joints)

    def variance(self, joint_angles: Angles) -> Angles:
        return np.full(joint_angles.shape, self.sd**2)


class White(Noise):
    """Independent Gaussian noise per joint and step: the paper's, q̃ = q + ε (section 3)."""

    def __init__(self, sigma_deg: Spread, joints: int | None = None) -> None:
        """Check the SD.

        Args:
            sigma_deg: degrees, in [0, 90].
            joints: J, of which each may have its own; None: one is for all.

        Raises:
            ValueError: for another one.
        """
        sigma = _radians("sigma_deg", sigma_deg, joints)
        self.sigma: float | Angles = sigma if isinstance(sigma, np.ndarray) else float(sigma)
        self.joints = np.size(sigma)

    def sample(self, rng: Rng, joint_angles: Angles) -> Angles:
        return rng.normal(0.0, self.sigma, len(joint_angles))

    def variance(self, joint_angles: Angles) -> Angles:
        return np.full(joint_angles.shape, self.sigma**2)


class Bias(Lasting):
    """A constant error per joint and episode, drawn from a normal."""

    decay, step_sd = 1.0, 0.0

    def __init__(self, bias_deg: Spread, joints: int | None = None) -> None:
        """Check the SD.

        Args:
            bias_deg: degrees, in [0, 90].
            joints: J, of which each may have its own; None: one is for all.

        Raises:
            ValueError: for another one.
        """
        self.sd = _radians("bias_deg", bias_deg, joints)
        self.joints = np.size(self.sd)

    def sample(self, rng: Rng, joint_angles: Angles) -> Angles:
        return self.value.copy()


class Drift(Lasting):
    """A slow error: an Ornstein–Uhlenbeck process, sampled exactly at the control rate.

    References:
        Gillespie 1996, Phys. Rev. E 54, 2084.
    """

    def __init__(self, drift_deg: Spread, drift_seconds: float, step_seconds: float, joints: int | None = None) -> None:
        """Check the numbers.

        Args:
            drift_deg: degrees, stationary SD, in [0, 90].
            drift_seconds: s, time constant.
            step_seconds: s, from one sample to the next.
            joints: J, of which each may have its own SD; None: one is for all.

        Raises:
            ValueError: for numbers out of range.
        """
        self.sd = _radians("drift_deg", drift_deg, joints)
        self.joints = np.size(self.sd)
        tau = validate.seconds("drift_seconds", drift_seconds)
        self.decay = np.exp(-validate.seconds("step_seconds", step_seconds) / tau)
        self.step_sd = self.sd * np.sqrt(1 - self.decay**2)

    def sample(self, rng: Rng, joint_angles: Angles) -> Angles:
        present = self.sampled = self.value
        fresh = self.step_sd * rng.standard_normal(len(joint_angles))
        self.value = self.decay * present + fresh
        return present


class Proportional(Noise):
    """White noise whose SD grows with the size of the angle."""

    def __init__(self, proportional: float) -> None:
        """Check the fraction.

        Args:
            proportional: SD over angle, in [0, 1].

        Raises:
            ValueError: for another one.
        """
        self.gain = validate.number("proportional", proportional, 0.0, 1.0)

    def sample(self, rng: Rng, joint_angles: Angles) -> Angles:
        return self.gain * np.abs(joint_angles) * rng.standard_normal(len(joint_angles))

    def variance(self, joint_angles: Angles) -> Angles:
        return (self.gain * joint_angles) ** 2


class Proprioception:
    """The sum of independent noises."""

    __repr__ = readable.line

    def __init__(self, noises: Sequence[Noise]) -> None:
        """Keep the noises that add anything.

        Args:
            noises: independent ones.
        """
        # A noise of zero SD adds nothing, and would be drawn at every step.
        self.noises = tuple(noise for noise in noises if noise.variance(np.ones(noise.joints)).any())

    def reset(self, rng: Rng, joints: int) -> None:
        """Draw whatever lasts for an episode.

        Args:
            rng: gives the draws.
            joints: J.
        """
        for noise in self.noises:
            noise.reset(rng, joints)

    def sample(self, rng: Rng, joint_angles: Angles) -> Angles:
        """Draw what is felt.

        Args:
            rng: gives the draws.
            joint_angles: (J,) rad, the true ones.

        Returns:
            (J,) rad, the felt ones.
        """
        felt = joint_angles if self.noises else joint_angles.copy()
        for noise in self.noises:
            felt = felt + noise.sample(rng, joint_angles)
        return felt

    def log_prob(self, felt: ArrayLike, joint_angles: ArrayLike) -> float:
        """Score what was felt at one step.

        Bias and drift enter with the variance that they have over episodes: successive steps are not independent.

        Args:
            felt: (J,) rad.
            joint_angles: (J,) rad, the true ones.

        Returns:
            The log density.

        Raises:
            ValueError: for other shapes, and what is not finite or beyond ± `LARGEST` rad.
        """
        said, true = validate.together(LARGEST, felt=felt, joint_angles=joint_angles)
        variance = sum((noise.variance(true) for noise in self.noises), np.zeros(true.shape))
        return log_normal(said, true, np.sqrt(variance))


def _radians(what: str, degrees: Spread, joints: int | None) -> Any:
    """An SD in [0, 90] degrees, or one of each of J joints, in radians."""
    return np.deg2rad(validate.one_or_each(what, degrees, joints, 0.0, 90.0, unit="degrees"))
