"""The pose of the hand as one Gaussian: an extended Kalman filter with a fixed lag, which knows what contact does.

Everything here is the same for all particles, so it is computed once. Shapes: J joints, P patches, D numbers of state,
(q, v) and, where forces last, the joints' torques by them, E numbers of errors that last (`observer.pose.angle_noise`),
T steps of lag. The filter keeps state and errors of now and the angles of each of the last T steps in one vector of
S = D + E + T·J numbers, so that every measurement corrects the past as well: an exact fixed-lag smoother of the
linearised model (Anderson & Moore 1979, Optimal Filtering, section 7.3). What contacts say of the motion, without any
map, `observer.pose.contact_dynamics` tells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.kinematics import tree_of
from observer.pose import kalman_updates
from observer.pose.angle_noise import AngleNoise, KeepsErrors
from observer.pose.contact_dynamics import MANY, ON_A_WRIST, WITH_OFFSETS, ContactDynamics, ContactEffects
from observer.pose.coupled_joints import keep_together
from observer.pose.forward_model import ForwardModel, Prediction
from observer.pose.found_sigma import FoundSigma
from observer.pose.gating import Gate, Gated, Heard, take_in
from observer.pose.kalman_updates import Measurement
from observer.pose.usual_step import LOST, NOT_USUAL, Gates, UsualHand, UsualTold, usual_step

EXACTLY = 1e-10  # rad² and (rad/s)²: variance of a start that is known
RESTART_ANGLE, RESTART_SPEED = 0.1**2, 1.0  # rad², (rad/s)²: variances of a filter that was lost
MODEL_NOISE, WITH_OFFSETS_NOISE = 0.6, 0.8  # rad/s a step: what the forward model leaves out, without and with offsets
LIGHT, HEAVIEST = 2.3, 0.1  # rad/s: what a full torque gives a finger's joint in 20 ms; the share of what is heaviest
FAR_SDS = 4.0  # of a felt angle from the expected one: beyond it the motion, not the offset, is to blame


class PoseFilter(KeepsErrors, Gated):
    """Posterior of (q, v) and of the lagged angles given efference copies, felt angles and felt contacts.

    Attributes:
        hand: with J joints and P patches.
        joints: J.
        lag: T.
        motor_noise: SD of a torque as a fraction of it.
        velocity_noise: (J,) rad/s, SD of what the model leaves out of a step; may be set, to one number for all, too.
        noise: what is wrong with the felt angles, beside white noise of SD `sigma`.
        dynamics: what contact does to the motion.
        model: of what torques do to the hand.
        mean: (S,), `mean[lagged(k)]` being the angles (J,) rad of k steps ago.
        covariance: (S, S), in the same order.
        log_evidence: log density of the angles felt so far.
    """

    def __init__(
        self,
        hand: Hand,
        *,
        sigma: float | Array,
        motor_noise: float,
        control_hz: float,
        lag: int,
        dynamics: ContactDynamics | None = None,
        noise: AngleNoise | None = None,
        velocity_noise: float | Array | None = None,
    ) -> None:
        """Start at the rest pose.

        Args:
            hand: with J joints and P patches.
            sigma: rad, SD of white noise of the felt angles, of all joints or (J,).
            motor_noise: SD of a torque as a fraction of it.
            control_hz: Hz, steps a second.
            lag: T.
            dynamics: what contact does to the motion; None: forces last where the felt angles have offsets, and are
                stronger where a wrist moves.
            noise: what else is wrong with the felt angles; None: nothing.
            velocity_noise: rad/s, SD of what the model leaves out of a step, of all joints or (J,); None: more where
                there are offsets, and less of joints that are heavier than those of fingers.
        """
        self.hand = hand
        self.joints = hand.joints
        self.lag = lag
        self.motor_noise = motor_noise
        self.noise = AngleNoise(hand.joints, 1.0 / control_hz) if noise is None else noise
        offsets = len(self.noise.lasting) > 0
        if velocity_noise is None:
            light = np.clip(ForwardModel(hand, 50.0).reach(hand.rest_pose) / LIGHT, HEAVIEST, 1.0)
            light[hand.wrist] = 1.0
            velocity_noise = light * (WITH_OFFSETS_NOISE if offsets else MODEL_NOISE)
        self.velocity_noise: float | Array = velocity_noise
        usually = ON_A_WRIST if hand.wrist.size else ContactDynamics()
        self.dynamics = (WITH_OFFSETS if offsets else usually) if dynamics is None else dynamics
        self.model = ForwardModel(hand, control_hz)
        self._effects = ContactEffects(hand, self.dynamics, control_hz)
        self._state = (3 if self._effects.lasts else 2) * hand.joints
        self._errors, self._kinds = len(self.noise.decay), self.noise.kinds(self._state, hand.joints)
        self.doubted = np.zeros(len(hand.patches), dtype=bool)  # patches at which something may press unfelt
        self._gate = Gate(hand, sigma, 1.0 / control_hz, self.noise.sd)
        self._finds = self.noise.finds_sigma
        skin = self._effects.usual if self.noise.is_white and not self._errors and not hand.couplings else None
        self._usual = None if skin is None else UsualHand(tree_of(hand), hand.torque_limits, *skin, MANY)
        self.reset()

    def reset(self, felt: Array | None = None) -> None:
        """Start at the rest pose, at rest, as exactly as it is known.

        Args:
            felt: (J,) rad, the angles felt there, which tell of the offsets, if any.
        """
        start = max(self.noise.start_variance, EXACTLY)
        self._begin(self.hand.rest_pose, start, EXACTLY, self.noise.start_variance)
        self.log_evidence = 0.0  # log density of the angles felt so far
        self._contacts = np.zeros(len(self.hand.patches), dtype=bool)
        self._gate.reset()
        self._found = FoundSigma() if self._finds else None
        if self._found is not None:
            self._gate.sigma = self._found.sigma
        if felt is not None and (self._errors or start > EXACTLY):
            expected = self._expected()
            heard = self._gate.judge(felt, *expected)
            self._feel(felt, heard, expected, Measurement.nothing(self.joints))
            self._find_sigma(felt, heard)

    def _begin(self, angles: Array, variance: float, of_speed: float, shared: float = 0.0) -> None:
        """Start at `angles` (J,) rad: `shared` is the part of their `variance` that those of the past share."""
        joints, lagged = self.joints, self.lag + 1
        present = self._state + self._errors
        self.mean = np.concatenate([angles, np.zeros(present - joints), np.tile(angles, self.lag)])
        self.covariance = np.zeros((self.mean.size, self.mean.size))
        poses = [*range(joints), *range(present, self.mean.size)]
        self.covariance[np.ix_(poses, poses)] = np.kron(np.full((lagged, lagged), shared), np.eye(joints))
        self.covariance[poses, poses] = variance
        errors = np.arange(self._state, present)
        self.covariance[errors, errors] = self.noise.prior
        speeds = np.arange(joints, 2 * joints)
        self.covariance[speeds, speeds] = of_speed

    def step(self, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]) -> None:
        """Move on by one control step.

        Args:
            torque: (J,) that was commanded, fractions of the limits.
            joint_angles: (J,) rad that were felt after it.
            contacts: (P,) that were felt.
        """
        prediction = self.model.predict(self.mean[: 2 * self.joints], torque)
        if self._usual is None or not self._take_usual(prediction, torque, joint_angles, contacts):
            self._take(prediction, torque, joint_angles, contacts)
        self._contacts = contacts

    def _take_usual(
        self, prediction: Prediction, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]
    ) -> bool:
        """Take a step as most are, in one call; False: it is none, and nothing has changed."""
        if self._finds or self.doubted.any():
            return False
        white = self.noise.variance(self.sigma, *self._expected())
        noises = float(self.motor_noise), self.velocity_noise * np.ones(self.joints)
        told = UsualTold(torque, contacts, self._contacts, joint_angles, white)
        gaussian, gates = (self.mean, self.covariance), Gates(*self._gate.bounds)
        outcome, density = usual_step(gaussian, prediction, self._usual, noises, told, gates)
        if outcome == NOT_USUAL:
            return False
        self._gate.pass_by()
        before, self.log_evidence = self.log_evidence, self.log_evidence + density
        if outcome == LOST:
            self._restart_if_lost(joint_angles, before)
        return True

    def _take(self, prediction: Prediction, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]) -> None:
        """Take any step."""
        joints, before = self.joints, self.log_evidence
        gain = prediction.torque_gain
        noise = kalman_updates.process_noise(
            gain, torque, self.model.torque_limits, self.motor_noise, self.velocity_noise * np.ones(joints)
        )
        if self._effects.lasts:
            whole = np.zeros((self._state, self._state))
            whole[: 2 * joints, : 2 * joints] = noise
            noise = whole
        known = contacts | self._contacts
        felt = np.flatnonzero(known | self.doubted)
        still, push = self._effects.of_step(prediction.state[:joints], gain, contacts, felt, ~known[felt], noise)
        if self.hand.couplings:
            keep_together(self.hand.couplings, prediction.state[:joints], noise)
        if push.any():
            prediction.state[:] += gain @ push
        moved = self._moved(prediction, felt)
        kalman_updates.shift(self.mean, self.covariance, *moved, noise, joints, self.noise.decay, self.noise.fresh)
        expected = self._expected()
        heard = self._gate.judge(joint_angles, *expected)
        self._feel(joint_angles, heard, expected, still)
        if not self._restart_if_lost(joint_angles, before):
            self._find_sigma(joint_angles, heard)

    def _restart_if_lost(self, joint_angles: Array, before: float) -> bool:
        """Begin anew where the Gaussian is none of poses of the hand, with the log evidence of `before` this step."""
        if not self._gate.lost(self.mean, self.covariance, self._state + self._errors):
            return False
        self.log_evidence = before  # what it said of this step may be no number
        self._begin(self._gate.at_last(self.mean[: self.joints], joint_angles), RESTART_ANGLE, RESTART_SPEED)
        return True

    def _moved(self, prediction: Prediction, felt: NDArray[np.int64]) -> tuple[Array, Array]:
        """Move the state on, and with it the forces that last.

        Args:
            prediction: of (q, v) in free air.
            felt: (F,) the patches in contact now or a step ago, and those that are doubted.

        Returns:
            Mean (D,) and transition (D, D) of the state.
        """
        if not self._effects.lasts:
            return prediction.state, prediction.transition
        joints = self.joints
        pressing, kept = self.mean[2 * joints : self._state], self._effects.kept(felt)
        transition = np.zeros((self._state, self._state))
        transition[: 2 * joints, : 2 * joints] = prediction.transition
        transition[: 2 * joints, 2 * joints :] = prediction.torque_gain
        transition[2 * joints :, 2 * joints :] = np.diag(kept)
        return np.concatenate([prediction.state + prediction.torque_gain @ pressing, kept * pressing]), transition

    def _feel(self, felt: Array, heard: Heard | None, expected: tuple[Array, Array], still: Measurement) -> None:
        """Take in what was measured at a step.

        Args:
            felt: (J,) rad.
            heard: those of them that are believed; None: all.
            expected: mean and variance (J,) of the angles without white noise.
            still: velocities that are near zero.
        """
        white = self.noise.variance(self.sigma, *expected)
        if self.learns and heard is None:
            self._doubt(felt - expected[0], expected[1] + white)
        self.log_evidence += kalman_updates.condition(
            self.mean,
            self.covariance,
            still,
            felt if heard is None else np.zeros(0),
            white,
            self._state,
            self._errors,
        )
        if heard is not None:
            self.log_evidence += take_in(self.mean, self.covariance, heard, white, self._kinds)

    def _find_sigma(self, felt: Array, heard: Heard | None) -> None:
        """Learn σ, where it is to be found out, from a step after which the Gaussian is sound.

        Args:
            felt: (J,) rad.
            heard: those of them that are believed; None: all.
        """
        if self._found is not None:
            mean, variance = self._expected()
            angles, told = (felt, slice(None)) if heard is None else (heard.angles, heard.joints)
            self._found.learn((angles - mean)[told], variance[told])
            self._gate.sigma = self._found.sigma

    def _doubt(self, away: Array, variance: Array) -> None:
        """Make the present angles as uncertain as what is felt says, where it is far from what was expected.

        A joint that is pushed off its limit moves as the linearised model cannot have it move. Where nothing else is
        uncertain that would be taken for an offset, and kept.

        Args:
            away: (J,) rad, felt less expected.
            variance: (J,) rad², of that.
        """
        far = np.flatnonzero(away**2 > FAR_SDS**2 * variance)
        if far.size:
            self.covariance[far, far] += away[far] ** 2 - variance[far]

    @property
    def sigma(self) -> float | Array:
        """Rad: SD of the noise of the felt angles, (J,) where joints differ. May be set, from the next step on; it is
        not found out any more."""
        return self._gate.sigma

    @sigma.setter
    def sigma(self, sigma: float | Array) -> None:
        self._gate.sigma = sigma
        self._finds, self._found = False, None

    @property
    def angles(self) -> Array:
        """(J,) rad: posterior mean of now."""
        return self.mean[: self.joints].copy()

    def lagged(self, steps: int) -> slice:
        """Tell where `mean` keeps the angles of a step.

        Args:
            steps: how many ago, 0 being now.

        Returns:
            J numbers.
        """
        start = 0 if steps == 0 else self._state + self._errors + (steps - 1) * self.joints
        return slice(start, start + self.joints)
