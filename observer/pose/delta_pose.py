"""The pose as the paper tracks it: an efference copy that moves the joints, and angles that are felt (section 3).

Shapes: J joints, T steps of lag, S steps of babbling. Angles in radians.

Equation 2 with a simple f: q_k = q_{k-1} + f(u) + N(0, Q), f(u) = G u. "Motion is only possible if there is no hard
contact": a finger that feels contact may move as commanded or not at all, and no joint leaves its limits. A particle
that stood at q_{k-1} draws its next pose from

    p(q_k | q_{k-1}, u, q̃_k) = N(q_{k-1} + f + K (q̃_k - q_{k-1} - f), (1 - K) Q),     K = Q (Q + R)⁻¹,

where q̃_k - q_{k-1} is the paper's "delta pose" and R = σ² of equation 1: the proposal of FastSLAM 2.0.
`HapticSLAM` forms it from the Gaussian over (q_k, q_{k-1}) that is kept here.
"""

from __future__ import annotations

import copy
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.pose.angle_noise import AngleNoise, KeepsErrors
from observer.pose.contact_dynamics import ContactDynamics
from observer.pose.gating import Gate, Gated, Heard, take_in
from observer.pose.kalman import EXACTLY, RESTART_ANGLE

HOLDS = 300
HOLD_SECONDS = 0.2  # about as long as a torque of random exploration lasts
SUBSTEP_SECONDS = 0.002


class DeltaMotion(NamedTuple):
    """q_k - q_{k-1} = gain · u + N(0, noise).

    Attributes:
        gain: (J, J) rad by fractions of the torques' limits.
        noise: (J, J) rad².
    """

    gain: Array
    noise: Array


class DeltaPose(KeepsErrors, Gated):
    """Posterior of the angles of now and of the last T steps under the linear motion model; for `HapticSLAM`.

    Attributes:
        hand: with J joints and P patches.
        motor_noise: SD of a torque as a fraction of it.
        lag: T.
        motion: what the hand has learnt by babbling.
        noise: what is wrong with the felt angles, beside white noise of SD `sigma`.
        mean: (S,), `mean[lagged(k)]` being the angles (J,) rad of k steps ago; the errors that last come after them.
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
    ) -> None:
        """Babble, then start at the rest pose.

        Args:
            hand: with J joints and P patches.
            sigma: rad, SD of white noise of the felt angles.
            motor_noise: SD of a torque as a fraction of it.
            control_hz: Hz, steps a second.
            lag: T.
            dynamics: not used: the paper's motion knows no forces.
            noise: what else is wrong with the felt angles; None: nothing.
        """
        self.hand = hand
        self.motor_noise = motor_noise
        self.lag = lag
        self.motion = babble(hand, control_hz)
        self.noise = AngleNoise(hand.joints, 1.0 / control_hz) if noise is None else noise
        self._kinds = self.noise.kinds((lag + 1) * hand.joints, hand.joints)
        self._gate = Gate(hand, sigma, 1.0 / control_hz, self.noise.sd)
        self.reset()

    def reset(self, felt: Array | None = None) -> None:
        """Start at the rest pose, as exactly as it is known.

        Args:
            felt: (J,) rad, the angles felt there, which tell of the offsets, if any.
        """
        self._begin(self.hand.rest_pose, EXACTLY, self.noise.start_variance)
        self.log_evidence = 0.0
        self._gate.reset()
        if felt is not None and (len(self.noise.decay) or self.noise.start_variance):
            self._feel(felt)

    def _begin(self, angles: Array, variance: float, shared: float = 0.0) -> None:
        """Start at `angles` (J,) rad: `shared` is what those of the past have in common beside their `variance`."""
        joints, poses = self.hand.joints, (self.lag + 1) * self.hand.joints
        self.mean = np.concatenate([np.tile(angles, self.lag + 1).astype(np.float64), np.zeros(len(self.noise.decay))])
        self.covariance = np.diag(np.concatenate([np.full(poses, variance), self.noise.prior]))
        self.covariance[:poses, :poses] += np.kron(np.full((self.lag + 1, self.lag + 1), shared), np.eye(joints))

    def step(self, torque: Array, joint_angles: Array, contacts: NDArray[np.bool_]) -> None:
        """Move on by one control step.

        Args:
            torque: (J,) that was commanded, fractions of the limits.
            joint_angles: (J,) rad that were felt after it.
            contacts: (P,) that were felt.
        """
        joints, size, before = self.hand.joints, self.mean.size, self.log_evidence
        errors = slice(size - len(self.noise.decay), size)
        poses = np.arange(errors.start - joints)
        # Now's angles twice, the oldest dropped.
        kept = np.concatenate([np.arange(joints), poses, np.arange(errors.start, size)])
        mean, covariance = self.mean[kept], self.covariance[np.ix_(kept, kept)]
        move = self.motion.gain @ torque
        held = self.hand.stopped_by[self.hand.patches.link[contacts]].any(axis=0)
        mean[:joints] = np.clip(mean[:joints] + np.where(held, 0.0, move), *self.hand.joint_limits.T)
        effort = self.motion.gain * (self.motor_noise * np.abs(torque))
        covariance[:joints, :joints] += self.motion.noise + effort @ effort.T + np.diag(np.where(held, move, 0.0) ** 2)
        mean[errors] *= self.noise.decay
        covariance[errors] *= self.noise.decay[:, None]
        covariance[:, errors] *= self.noise.decay
        covariance[errors, errors] += np.diag(self.noise.fresh)
        self.mean, self.covariance = mean, covariance
        self._feel(joint_angles)
        if self._gate.lost(self.mean, self.covariance, 0):
            self.log_evidence = before  # what it said of this step may be no number
            self._begin(self._gate.at_last(self.mean[:joints], joint_angles), RESTART_ANGLE)

    def _feel(self, felt: Array) -> None:
        """Take in the `felt` angles (J,) rad."""
        joints = self.hand.joints
        expected = self._expected()
        heard = self._gate.judge(felt, *expected)
        if heard is None:
            heard = Heard(felt, np.arange(joints), np.zeros(joints, dtype=bool))
        white = self.noise.variance(self.sigma, *expected)
        self.log_evidence += take_in(self.mean, self.covariance, heard, white, self._kinds)

    def lagged(self, steps: int) -> slice:
        """Tell where `mean` keeps the angles of a step.

        Args:
            steps: how many ago, 0 being now.

        Returns:
            J numbers.
        """
        return slice(steps * self.hand.joints, (steps + 1) * self.hand.joints)


def babble(hand: Hand, control_hz: float) -> DeltaMotion:
    """Learn what torques do to the joints on average, by least squares over a minute of random ones in free air.

    The paper calls its motion model "simple" and says no more. Here the hand learns it by motor babbling: no object,
    no noise, no stops, torques drawn uniformly and held for `HOLD_SECONDS`. What a line cannot explain is momentum,
    which lasts: its variance is that of the sum over a hold, shared among the steps.

    Args:
        hand: with J joints.
        control_hz: Hz, steps a second.

    Returns:
        The motion of one step.
    """
    rng = np.random.default_rng(0)
    substeps = max(1, round(1 / (control_hz * SUBSTEP_SECONDS)))
    model = copy.copy(hand.model)
    model.opt.timestep = 1 / (control_hz * substeps)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    data.qpos[:] = hand.rest_pose
    hold = max(1, round(HOLD_SECONDS * control_hz))
    torques = np.repeat(rng.uniform(-1, 1, (HOLDS, hand.joints)), hold, axis=0)  # (S, J)
    path = [data.qpos.copy()]
    for torque in torques:
        data.ctrl[:] = torque
        mujoco.mj_step(model, data, substeps)
        path.append(data.qpos.copy())
    deltas = np.diff(path, axis=0)
    low, high = hand.joint_limits.T
    free = (path[1:] > low) & (path[1:] < high)  # (S, J): which joints a stop did not hold
    gain = np.stack([np.linalg.lstsq(torques[w], y[w], rcond=None)[0] for w, y in zip(free.T, deltas.T, strict=True)])
    rest = (free * (deltas - torques @ gain.T)).reshape(HOLDS, hold, hand.joints).sum(axis=1)
    steps = np.sqrt(free.sum(axis=0))
    return DeltaMotion(gain, rest.T @ rest / np.outer(steps, steps))
