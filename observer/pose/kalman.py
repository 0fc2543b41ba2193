"""The pose of the hand as one Gaussian: an extended Kalman filter with a fixed lag, which knows what contact does.

Everything here is the same for all particles, so it is computed once. Shapes: J joints, D numbers of state, (q, v) and,
where forces last, the joints' torques by them, E numbers of errors that last (`observer.pose.angle_noise`), T steps of
lag. The filter keeps state and errors of now and the angles of each of the last T steps in one vector of D + E + T·J
numbers, so that every measurement corrects the past as well: an exact fixed-lag smoother of the linearised model
(Anderson & Moore 1979, Optimal Filtering, section 7.3).

A patch that feels contact says three things without any map. (1) A force acts there: unknown in size, mostly along
the skin's normal; it enters as process noise through the contact Jacobian, J_cᵀ f, not as noise of every joint. Where
the felt angles have offsets it matters that forces last: what presses for a while would be taken for an offset.
(2) The skin there does not move into the object, which stands still: its velocity is near zero along the normal and,
with friction, along the surface. Both are linear. What is normal is as vague as the patch is round.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.patches import Patches
from observer.kinematics import tree_of
from observer.pose import kalman_updates
from observer.pose.angle_noise import AngleNoise, FoundSigma, Offset, summed
from observer.pose.forward_model import ForwardModel, Prediction
from observer.pose.gating import Gate, Gated, Heard, take_in

SKIN_SPACING = 0.001  # metres
EXACTLY = 1e-10  # rad² and (rad/s)²: variance of a start that is known
RESTART_ANGLE, RESTART_SPEED = 0.1**2, 1.0  # rad², (rad/s)²: variances of a filter that was lost
MANY = 256  # patches in contact: with more, what they say of the joints' speeds is put together first


@dataclass(frozen=True)
class ContactDynamics:
    """What a felt contact does to the motion; forces in N, speeds in m/s, angular speeds in rad/s.

    With `constrained`, contact acts at the patch that feels it: `normal_force` and `tangential_force` are SDs of the
    unknown force of one step, and `lasting` times as much that of a part that lasts, and fades within `seconds` (0:
    there is none); `pressing` N is what presses against the patches of a link on average. `normal_speed` and
    `tangential_speed` are SDs of the skin's velocity about zero. Otherwise every joint of a finger in contact gets
    process noise of `joint_speed`.
    """

    constrained: bool = True
    normal_force: float = 0.7
    tangential_force: float = 0.3
    normal_speed: float = 0.02
    tangential_speed: float = 0.05
    joint_speed: float = 15.0
    pressing: float = 0.0
    lasting: float = 0.0
    seconds: float = 0.1

    def __post_init__(self) -> None:
        validate.boolean("constrained", self.constrained)
        for name in ("normal_force", "tangential_force", "joint_speed", "pressing", "lasting"):
            object.__setattr__(self, name, validate.number(name, getattr(self, name), 0.0, 1e3))
        for name in ("normal_speed", "tangential_speed"):
            object.__setattr__(self, name, validate.number(name, getattr(self, name), 1e-6, 1e3, unit="m/s"))
        object.__setattr__(self, "seconds", validate.seconds("seconds", self.seconds))


WITH_OFFSETS = ContactDynamics(normal_force=0.5, tangential_force=0.25, pressing=0.5, lasting=2.0)
MODEL_NOISE, WITH_OFFSETS_NOISE = 0.6, 0.8  # rad/s a step: what the forward model leaves out, without and with offsets


class PoseFilter(Gated):
    """Posterior of (q, v) and of the lagged angles given efference copies, felt angles and felt contacts."""

    def __init__(
        self,
        hand: Hand,
        *,
        sigma: float,
        motor_noise: float,
        control_hz: float,
        lag: int,
        dynamics: ContactDynamics | None = None,
        noise: AngleNoise | None = None,
        velocity_noise: float | None = None,
    ) -> None:
        """`sigma` rad; `motor_noise` a fraction; `noise`: what else is wrong with the felt angles (None: nothing);
        `dynamics` (None: forces last where the felt angles have offsets); `velocity_noise` rad/s a step, for what the
        model leaves out (None: more where they have)."""
        self.hand = hand
        self.joints = hand.joints
        self.lag = lag
        self.motor_noise = motor_noise
        self.noise = AngleNoise(hand.joints, 1.0 / control_hz) if noise is None else noise
        offsets = len(self.noise.lasting) > 0
        usual = WITH_OFFSETS_NOISE if offsets else MODEL_NOISE
        self.velocity_noise = usual if velocity_noise is None else velocity_noise
        self.dynamics = (WITH_OFFSETS if offsets else ContactDynamics()) if dynamics is None else dynamics
        self.model = ForwardModel(hand, control_hz)
        self._tree = tree_of(hand)
        self._patch_body = hand.link_bodies[hand.patches.link]
        self._axes, share, self._outward = _normals(hand.patches)
        how = self.dynamics
        self._forces = np.sqrt(how.normal_force**2 * share + how.tangential_force**2 * (1 - share))
        self._speeds = np.sqrt(how.normal_speed**2 * share + how.tangential_speed**2 * (1 - share))
        self._fade = np.exp(-1.0 / (control_hz * self.dynamics.seconds))
        self._lasts = self.dynamics.lasting > 0.0 and self.dynamics.constrained
        self._state = (3 if self._lasts else 2) * hand.joints
        self._errors, self._kinds = len(self.noise.decay), self.noise.kinds(self._state, hand.joints)
        self._gate = Gate(hand, sigma, 1.0 / control_hz, self.noise.sd)
        self.reset()

    def reset(self, felt: Array | None = None) -> None:
        """Start at the rest pose, at rest, as exactly as it is known; `felt` (J,) rad tells of the offsets, if any."""
        start = max(self.noise.start_variance, EXACTLY)
        self._begin(self.hand.rest_pose, start, EXACTLY, self.noise.start_variance)
        self.log_evidence = 0.0  # log density of the angles felt so far
        self._contacts = np.zeros(len(self.hand.patches), dtype=bool)
        self._gate.reset()
        self._found = FoundSigma() if self.noise.finds_sigma else None
        if self._found is not None:
            self.sigma = self._found.sigma
        if felt is not None and (self._errors or start > EXACTLY):
            expected = self._expected()
            nothing = np.zeros((0, 2 * self.joints)), np.zeros(0)
            self._feel(felt, self._gate.judge(felt, *expected), expected, *nothing)

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
        """Move on by one control step: `torque` (J,) fractions, felt `joint_angles` (J,) rad, `contacts` (P,)."""
        joints, before = self.joints, self.log_evidence
        prediction = self.model.predict(self.mean[: 2 * joints], torque)
        gain = prediction.torque_gain
        noise = kalman_updates.process_noise(
            gain, torque, self.model.torque_limits, self.motor_noise, self.velocity_noise
        )
        if self._lasts:
            whole = np.zeros((self._state, self._state))
            whole[: 2 * joints, : 2 * joints] = noise
            noise = whole
        rows, speeds, push = self._contact_effects(prediction.state[:joints], gain, contacts, noise)
        if push.any():
            prediction.state[:] += gain @ push
        kalman_updates.shift(
            self.mean,
            self.covariance,
            *self._moved(prediction, contacts),
            noise,
            joints,
            self.noise.decay,
            self.noise.fresh,
        )
        expected = self._expected()
        self._feel(joint_angles, self._gate.judge(joint_angles, *expected), expected, rows, speeds)
        if self._gate.lost(self.mean, self.covariance, self._state + self._errors):
            self.log_evidence = before  # what it said of this step may be no number
            self._begin(self._gate.at_last(self.mean[:joints], joint_angles), RESTART_ANGLE, RESTART_SPEED)
        self._contacts = contacts

    def _moved(self, prediction: Prediction, contacts: NDArray[np.bool_]) -> tuple[Array, Array]:
        """What a step makes of the state: its mean (D,) and transition (D, D). Forces that last move it, too, and end
        where no patch of the finger feels contact."""
        if not self._lasts:
            return prediction.state, prediction.transition
        joints = self.joints
        pressing = self.mean[2 * joints : self._state]
        felt = np.flatnonzero(contacts | self._contacts)
        pressed = self.hand.stopped_by[self.hand.patches.link[felt]].any(axis=0)
        fade = np.where(pressed, self._fade, 0.0)
        transition = np.zeros((self._state, self._state))
        transition[: 2 * joints, : 2 * joints] = prediction.transition
        transition[: 2 * joints, 2 * joints :] = prediction.torque_gain
        transition[2 * joints :, 2 * joints :] = np.diag(fade)
        return np.concatenate([prediction.state + prediction.torque_gain @ pressing, fade * pressing]), transition

    def _feel(
        self, felt: Array, heard: Heard | None, expected: tuple[Array, Array], rows: Array, speeds: Array
    ) -> None:
        """Condition on the `felt` angles (J,) rad, of which some may not be `heard`, and on velocities, `rows`
        (M, 2J), that are 0 with the SDs `speeds` (M,)."""
        white = self.noise.variance(self.sigma, *expected)
        self.log_evidence += kalman_updates.condition(
            self.mean,
            self.covariance,
            rows,
            np.zeros(len(rows)),
            speeds**2,
            felt if heard is None else np.zeros(0),
            white,
            self._state,
            self._errors,
        )
        if heard is not None:
            self.log_evidence += take_in(self.mean, self.covariance, heard, white, self._kinds)
        if self._found is not None:
            mean, variance = self._expected()
            angles, told = (felt, slice(None)) if heard is None else (heard.angles, heard.joints)
            self._found.learn((angles - mean)[told], variance[told])
            self.sigma = self._found.sigma

    def _expected(self) -> tuple[Array, Array]:
        """The angles (J,) rad that would be felt without white noise: mean and variance."""
        return summed(self.mean, self.covariance, [slice(0, self.joints), *self._kinds])

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
        return Offset.of(self.mean, self.covariance, self._kinds, self.joints)

    @property
    def angles(self) -> Array:
        """(J,) rad: posterior mean of now."""
        return self.mean[: self.joints].copy()

    def lagged(self, steps: int) -> slice:
        """Where `mean` keeps the angles of `steps` steps ago, 0 being now."""
        start = 0 if steps == 0 else self._state + self._errors + (steps - 1) * self.joints
        return slice(start, start + self.joints)

    def _contact_effects(
        self, q: Array, gain: Array, contacts: NDArray[np.bool_], noise: Array
    ) -> tuple[Array, Array, Array]:
        """Add to `noise` (D, D) what contact forces do; rows (M, 2J) of velocities that are near zero, their SDs
        (M,), and what forces are on average, N·m at the joints (J,)."""
        joints, how = self.joints, self.dynamics
        felt = np.flatnonzero(contacts | self._contacts)
        if not how.constrained:
            moved = self.hand.stopped_by[self.hand.patches.link[felt]].any(axis=0)
            index = joints + np.flatnonzero(moved)
            noise[index, index] += how.joint_speed**2
        if felt.size == 0 or not how.constrained:
            return np.zeros((0, 2 * joints)), np.zeros(0), np.zeros(joints)
        along = np.empty((felt.size, 3, joints))
        kalman_updates.contact_effects(
            self._tree,
            q,
            gain,
            self._patch_body,
            self.hand.patches.position,
            self._axes,
            self._forces,
            how.lasting * np.sqrt(1.0 - self._fade**2) if self._lasts else 0.0,
            felt,
            noise,
            along,
        )
        still = contacts[felt]
        speeds, sd = along[still].reshape(-1, joints), self._speeds[felt[still]].ravel()
        if np.count_nonzero(still) > MANY:
            # As many as there are joints say the same: rows of unit variance with the same sum of squares.
            speeds = np.asarray(np.linalg.qr(speeds / sd[:, None], mode="r"))
            sd = np.ones(len(speeds))
        rows = np.zeros((len(speeds), 2 * joints))
        rows[:, joints:] = speeds
        return rows, sd, self._push(along[:, 2], felt, contacts)

    def _push(self, outward: Array, felt: NDArray[np.int64], contacts: NDArray[np.bool_]) -> Array:
        """Torques (J,) N·m by what presses, on average, against the skin of the patches `felt` (F,): `outward` (F, J) m
        is how far a joint moves it outwards. A touch that has just ended has pressed for half of the step."""
        if self.dynamics.pressing == 0.0:
            return np.zeros(self.joints)
        link = self.hand.patches.link[felt]
        shared = self._outward[felt] / np.bincount(link)[link]
        return -self.dynamics.pressing * (shared * np.where(contacts[felt], 1.0, 0.5)) @ outward


@lru_cache(maxsize=8)
def _normals(patches: Patches) -> tuple[Array, Array, Array]:
    """How the skin's normal is spread over each patch: principal axes (P, 3, 3), rows in the link's frame, and the
    mean square (P, 3) of the normal along each. A flat patch has (0, 0, 1), a round fingertip a third along each. And
    the mean (P,) along the last axis, by which it points outwards or inwards."""
    skin = patches.surface(SKIN_SPACING)
    count = np.bincount(skin.patch, minlength=len(patches))
    moment = np.zeros((len(patches), 3, 3))
    np.add.at(moment, skin.patch, skin.normals[:, :, None] * skin.normals[:, None, :])
    share, axes = np.linalg.eigh(moment / count[:, None, None])
    outward = np.bincount(skin.patch, (skin.normals * axes[skin.patch, :, 2]).sum(axis=1), len(patches)) / count
    return np.ascontiguousarray(np.swapaxes(axes, 1, 2)), np.clip(share, 0.0, 1.0), outward
