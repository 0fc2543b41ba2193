"""The internal forward model: what the commanded torques do to a hand in free air (paper, section 3, step 3).

State x = (q, v) of 2J numbers: joint angles (rad) and velocities (rad/s). One control step maps it to f(x, u).
"""

from __future__ import annotations

import copy
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.compiled import kernel
from haptic_env.hand import Hand
from observer.gaussian import add, fill, times

STEP_SECONDS = 0.002  # coarser steps of the damped joints cost accuracy: 0.29 σ against 0.26 σ with 10 ms
PERTURBATION = 1e-4  # well above the tolerance of the constraint solver
WITHOUT_LIMITS = int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
LARGEST_GROWTH = 2.5  # of an angle's error in one control step; damped joints never get near it


class Prediction(NamedTuple):
    """What a control step makes of a state x under torques τ.

    Attributes:
        state: f(x, τ) (2J,).
        transition: ∂f/∂x (2J, 2J).
        torque_gain: ∂f/∂τ (2J, J), τ in N·m.
    """

    state: NDArray[np.float64]
    transition: NDArray[np.float64]
    torque_gain: NDArray[np.float64]


class ForwardModel:
    """MuJoCo's model of the hand alone, driven by the efference copy.

    Attributes:
        joints: J.
        torque_limits: (J,) N·m.
    """

    def __init__(self, hand: Hand, control_hz: float) -> None:
        """Take a copy of the hand's model.

        Args:
            hand: with J joints.
            control_hz: Hz, steps a second.

        Raises:
            ValueError: for a rate that is none, or out of range.
        """
        validate.number("control_hz", control_hz, 1.0, 500.0, unit="Hz")
        self.joints = hand.joints
        self.torque_limits = hand.torque_limits
        self._model = copy.copy(hand.model)
        self._model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        self._model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_WARMSTART
        # Limits of joints are all that there is to solve: a few sweeps are faster than Newton's method, and as exact.
        self._model.opt.solver = mujoco.mjtSolver.mjSOL_PGS
        self._model.opt.tolerance = 1e-10
        self._substeps = max(1, round(1 / (control_hz * STEP_SECONDS)))
        self._model.opt.timestep = 1 / (control_hz * self._substeps)
        self._data = mujoco.MjData(self._model)
        self._couplings = hand.couplings
        self._a = np.zeros((2 * self.joints, 2 * self.joints))
        self._b = np.zeros((2 * self.joints, self.joints))

    def predict(self, state: NDArray[np.float64], torque: NDArray[np.float64]) -> Prediction:
        """Predict one control step, and how it depends on where it begins.

        The Jacobian of one substep is taken half-way and raised to the number of substeps: near enough to the product
        of all, at a tenth of its price. Where a joint meets its limit within that very substep the differences straddle
        an impact and mean nothing; there the Jacobian without limits stands in.

        Args:
            state: (2J,) at the beginning.
            torque: (J,) fractions of the limits.

        Returns:
            The state at the end, and its derivatives.
        """
        model, data, joints = self._model, self._data, self.joints
        data.qpos[:] = state[:joints]
        data.qvel[:] = state[joints:]
        data.ctrl[:] = torque
        half = self._substeps // 2
        if half:
            mujoco.mj_step(model, data, half)
        transition, gain, grows = self._linearise()
        if grows:
            model.opt.disableflags |= WITHOUT_LIMITS
            transition, gain, _ = self._linearise()
            model.opt.disableflags &= ~WITHOUT_LIMITS
        mujoco.mj_step(model, data, self._substeps - half)
        after = np.concatenate([data.qpos, data.qvel])
        if self._couplings:  # what is left of their slack is no motion
            after[:joints] = self._couplings.follow(after[:joints])
            after[joints:] = self._couplings.spread(after[:joints]) @ after[joints:]
        return Prediction(after, transition, gain)

    def reach(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Tell how fast a full torque makes each joint in one control step from rest, whatever its limits.

        Args:
            angles: (J,) rad.

        Returns:
            (J,) rad/s.
        """
        rest, flags = np.concatenate([angles, np.zeros(self.joints)]), self._model.opt.disableflags
        self._model.opt.disableflags = flags | WITHOUT_LIMITS
        gain = self.predict(rest, np.zeros(self.joints)).torque_gain
        self._model.opt.disableflags = flags
        return np.diag(gain[self.joints :]) * self.torque_limits

    def _linearise(self) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
        """What `_repeated` gives of a whole control step, from the present substep."""
        mujoco.mjd_transitionFD(self._model, self._data, PERTURBATION, False, self._a, self._b, None, None)
        if self._couplings:
            along = self._couplings.along(self._data.qpos)
            self._a[:], self._b[:] = along @ self._a @ along, along @ self._b
        return _repeated(self._a, self._b, self._substeps, self.torque_limits)


@kernel()
def _repeated(a, b, steps, limits):
    """Put `steps` steps of x ← A·x + B·u into one, by repeated squaring; u is fractions of torque `limits` (J,) N·m.

    Returns:
        ∂f/∂x (2J, 2J), ∂f/∂τ (2J, J), and whether an angle's error grows beyond `LARGEST_GROWTH`, past all numbers
        maybe.
    """
    power, left = np.empty(a.shape), np.empty(b.shape)
    transition, gain = np.empty(a.shape), np.empty(b.shape)
    spare, other = np.empty(a.shape), np.empty(b.shape)
    fill(a, power)
    fill(b, left)
    for i in range(len(a)):
        for j in range(len(a)):
            transition[i, j] = 1.0 if i == j else 0.0
        for j in range(b.shape[1]):
            gain[i, j] = 0.0
    while steps > 0:
        if steps % 2 == 1:
            times(power, gain, other)
            times(power, transition, spare)
            gain, other = other, gain
            transition, spare = spare, transition
            for i in range(len(b)):
                add(1.0, left[i], gain[i])
        times(power, left, other)
        for i in range(len(b)):
            add(1.0, left[i], other[i])
        left, other = other, left
        times(power, power, spare)
        power, spare = spare, power
        steps //= 2
    joints, grows = len(limits), False
    for i in range(len(b)):
        for j in range(joints):
            gain[i, j] /= limits[j]
            grows |= i < joints and not abs(transition[i, j]) <= LARGEST_GROWTH
    return transition, gain, grows
