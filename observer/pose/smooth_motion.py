"""The pose where no torque is known: joints that move smoothly, now slowly and now fast.

Shapes: J joints, C directions (the joints, and sums and differences of each two), M levels of activity, T steps of lag,
S = 3 + T numbers of a direction's state: its angle, velocity and acceleration now, then its angle at each of the last T
steps. Angles in radians, seconds.

The velocity of a joint is a Matérn process of smoothness 3/2: an Ornstein-Uhlenbeck process driven by another, both of
time constant τ (Hartikainen & Särkkä 2010, MLSP, "Kalman filtering and smoothing solutions to temporal Gaussian
process regression models"), so that velocities and accelerations are continuous. Its SD is the joint's level of
activity. Hands rest and burst into motion: the level, one of M, now and then changes to one next to it. That is an
interacting multiple model filter (Blom & Bar-Shalom 1988, IEEE Trans. Autom. Control 33(8), 780-783), here one for
each joint and for the sum and the difference of each two, as joints move together (`joint_pairs`); the angles of the
last T steps in its state make it a fixed-lag smoother.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.pose.angle_noise import AngleNoise, FollowsFelt
from observer.pose.filter_bank import FilterBank
from observer.pose.gating import Gate, Gated, Heard
from observer.pose.interacting_models import JumpMarkovModel
from observer.pose.joint_pairs import JointPairs
from observer.pose.lagged_moments import PRESENT, LaggedMoments, no_covariance, spread_out

NOTHING = 1e8  # rad²: variance of a reading that tells of nothing
ANYWHERE = 2.0  # rad: SD of where a joint is before it was felt


@dataclass(frozen=True)
class SmoothMotion:
    """How joints move where no torque is known.

    The defaults did best on recordings that are not among those to be explained (docs/recordings.md).

    Attributes:
        speeds: (M,) rad/s, SDs of a joint's velocity, from slow to fast.
        seconds: s, time constant τ of its changes.
        dwell: s, how long a joint keeps to one level on average.
        together: probability that a joint moves with another one.
        temper: exponent of the evidence that tells with which.

    Raises:
        ValueError: for a value out of range, or speeds that do not rise.
    """

    speeds: tuple[float, ...] = (0.1, 0.3, 1.0, 3.0, 9.0)
    seconds: float = 0.03
    dwell: float = 0.2
    together: float = 0.8
    temper: float = 0.4

    def __post_init__(self) -> None:
        validate.instance("speeds", self.speeds, (tuple, list), "several numbers, rising")
        speeds = tuple(validate.number("speeds", speed, 1e-4, 1e4, unit="rad/s") for speed in self.speeds)
        if not speeds or list(speeds) != sorted(set(speeds)):
            raise ValueError(f"speeds must be rising, got {validate.shown(self.speeds)}")
        object.__setattr__(self, "speeds", speeds)
        for name, low, high, unit in (
            ("seconds", 0.005, 100.0, "s"),
            ("dwell", 1e-6, 1e9, "s"),
            ("together", 0.0, 0.999, ""),
            ("temper", 0.0, 1.0, ""),
        ):
            object.__setattr__(self, name, validate.number(name, getattr(self, name), low, high, unit=unit))

    def transition(self, step: float) -> Array:
        """Tell what a step makes of a direction, on average.

        Args:
            step: s.

        Returns:
            (3, 3), of angle, velocity and acceleration.
        """
        return np.asarray(expm(step * self._drift))

    def noise(self, step: float) -> Array:
        """Tell what a step adds at an SD of 1 rad/s (Van Loan 1978, IEEE Trans. Autom. Control 23(3), 395-404).

        Args:
            step: s.

        Returns:
            Covariance (3, 3) of angle, velocity and acceleration.
        """
        rate = 1.0 / self.seconds
        block = np.zeros((6, 6))
        block[:3, :3], block[3:, 3:] = -self._drift, self._drift.T
        block[2, 5] = 4.0 * rate**3
        power = expm(step * block)
        noise = power[3:, 3:].T @ power[:3, 3:]
        return 0.5 * (noise + noise.T)

    def switching(self, step: float) -> Array:
        """Tell how levels change: to one next to it, all neighbours alike.

        Args:
            step: s.

        Returns:
            (M, M) probability of each level after the step, row by row for the level before it.
        """
        count = len(self.speeds)
        leave = 1.0 - np.exp(-step / self.dwell)
        chain = np.zeros((count, count))
        for level in range(count):
            near = [each for each in (level - 1, level + 1) if 0 <= each < count]
            chain[level, near] = leave / max(len(near), 1)
            chain[level, level] = 1.0 - chain[level].sum()
        return chain

    @property
    def _drift(self) -> Array:
        rate = 1.0 / self.seconds
        return np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -(rate**2), -2.0 * rate]])


class KinematicPose(FollowsFelt, Gated):
    """Posterior of the angles of now and of the last T steps from the felt angles alone; for `HapticSLAM`.

    Nothing is known of where a movement begins; torques and contacts are not used.

    Attributes:
        hand: with J joints.
        lag: T.
        smooth: how joints move.
        partners: which of them move together.
        noise: what is wrong with the felt angles, beside white noise of SD `sigma`.
        apart: A, the steps by which two angles of the past may be apart for their covariance to be kept.
        mean: (S·J,), `mean[lagged(k)]` being the angles (J,) rad of k steps ago.
        covariance: (S·J, S·J), in the same order; NaN what is not kept.
        log_evidence: log density of the angles felt so far, of each joint by itself.
    """

    def __init__(
        self,
        hand: Hand,
        *,
        sigma: float,
        control_hz: float,
        lag: int,
        noise: AngleNoise | None = None,
        smooth: SmoothMotion | None = None,
        apart: int | None = None,
        **_: Any,
    ) -> None:
        """Start anywhere. The rest of what a motion may be given says nothing here.

        Where a hand is, nothing but the felt angles says: offsets are not found out.

        Args:
            hand: with J joints.
            sigma: rad, SD of white noise of the felt angles.
            control_hz: Hz, steps a second.
            lag: T.
            noise: what else is wrong with them; None: nothing.
            smooth: how joints move; None: the defaults.
            apart: A; None: all covariances are kept.
            **_: not used.

        Raises:
            ValueError: for a sigma of each joint: joints are taken together here.
        """
        if np.ndim(sigma):
            told = validate.shown(np.rad2deg(sigma).tolist())
            raise ValueError(f"sigma_deg must be one number for all joints with motion='kinematic', got {told}")
        self.hand = hand
        self.lag = lag
        self.smooth = SmoothMotion() if smooth is None else smooth
        self.partners = JointPairs(hand.joints, self.smooth.together, self.smooth.temper, hand.couplings.follows)
        step = 1.0 / control_hz
        squares = np.square(self.smooth.speeds)
        self._model = JumpMarkovModel(
            self.smooth.switching(step),
            self.smooth.transition(step),
            squares[:, None, None] * self.smooth.noise(step),
        )
        self._start = squares[:, None] * [1.0, self.smooth.seconds**-2]  # (M, 2): of velocity and acceleration
        self.noise = AngleNoise(hand.joints, step) if noise is None else noise
        self.apart = max(0, lag - 1 if apart is None else min(apart, lag - 1))
        self._lasting = self._of_offsets()
        self._gate = Gate(hand, sigma, step, self.noise.sd)
        self.reset()

    def reset(self, felt: Array | None = None) -> None:
        """Start a trial.

        Args:
            felt: (J,) rad, where the hand was felt to be; None: it may be anywhere, the rest pose being as good a guess
                as any.
        """
        self._gate.reset()
        self.partners.reset()
        self.log_evidence = 0.0
        self._start_at(None if felt is None else self._gate.at_first(felt))

    def _start_at(self, felt: Array | None) -> None:
        # It did not move before it was felt.
        start, spread = (self.hand.rest_pose, ANYWHERE) if felt is None else (felt, float(self.sigma))
        along = self.partners.along(start)
        self._bank = FilterBank.at_rest(self._model, along, spread**2, self._start, self.lag, self.apart)
        self.covariance = no_covariance(self.hand.joints, self.lag, self.apart)
        self._combine(self._bank.over_levels())

    def expect(self) -> None:
        """Do what the next step does before anything is felt at it, while there is time; else the step does it."""
        self._bank.expect()

    def step(self, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]) -> None:
        """Move on by one control step.

        Args:
            torque: not used.
            joint_angles: (J,) rad that were felt.
            contacts: not used.
        """
        joints, before = self.hand.joints, self.log_evidence
        heard = self._gate.judge(joint_angles, self.mean[:joints], self.covariance.diagonal()[:joints])
        log_density, moments = self._take(joint_angles, heard)
        self.log_evidence += float(log_density[:joints].sum())
        if np.isfinite(log_density).all():  # else the filter is lost, and nobody's partner known by it
            self.partners.learn(log_density)
        self._combine(moments)
        if self._gate.lost(self.mean, self.covariance, PRESENT * joints):
            self.log_evidence = before  # what it said of this step may be no number
            self._start_at(self._gate.at_first(joint_angles))

    def _take(self, joint_angles: Array, heard: Heard | None) -> tuple[Array, LaggedMoments]:
        """Move on by a step; the log density (C,) of what is felt, and the moments of the directions."""
        if heard is not None:
            return self._take_some(heard, self.sigma**2)
        return self._bank.step(self.partners.along(joint_angles), np.full(self.partners.count, self.sigma**2))

    def _take_some(self, heard: Heard, variance: float | Array) -> tuple[Array, LaggedMoments]:
        """Move on by a step in which some joints are not heard, and so no direction that they have a part in.

        Args:
            heard: those that are.
            variance: rad², of what is heard along each direction (C,), or of all.

        Returns:
            The log density (C,) of what is heard, which says nothing of partners that are not, and the moments of the
            directions.
        """
        joints = self.hand.joints
        told = np.isin(np.arange(joints), heard.joints)
        along = self.partners.along(np.where(told, heard.angles, self.mean[:joints]))
        if heard.anew.any():
            wrong = np.where(heard.anew, heard.angles - self.mean[:joints], 0.0)
            self._bank.widen(self.partners.along_squares(wrong**2))
        variance = np.where(self.partners.all_of(told), variance, NOTHING)
        log_density, moments = self._bank.step(along, variance)
        return self.partners.without(log_density, told), moments

    def lagged(self, steps: int) -> slice:
        """Tell where `mean` keeps the angles of a step.

        Args:
            steps: how many ago, 0 being now.

        Returns:
            J numbers.
        """
        first = 0 if steps == 0 else (PRESENT - 1 + steps) * self.hand.joints
        return slice(first, first + self.hand.joints)

    def _combine(self, moments: LaggedMoments) -> None:
        """One Gaussian over all joints with the mean and covariance of what the directions, `moments`, say of each."""
        self.mean = np.empty(len(self.covariance))
        spread_out(self.partners.of_joints(moments), self._lasting, self.mean, self.covariance)

    def _of_offsets(self) -> Array:
        """(1 + T, J) rad²: what felt angles have in common by their offsets, by the steps between them."""
        joints = self.hand.joints
        first = self.noise.over_time(1 + self.lag)[:joints]  # as the angles are felt, so they are followed
        return np.stack([first[:, each : each + joints].diagonal() for each in range(0, first.shape[1], joints)])
