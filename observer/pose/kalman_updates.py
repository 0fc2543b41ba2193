"""The compiled parts of the pose filter: move on and condition, in place.

Shapes: J joints, D numbers of state, (q, v) and, where forces last, the joints' torques by them, E numbers of errors
that last, S = D + E + T·J numbers of the filter with T steps of lag, M measurements. Loops over the last axis are
plain, so that they vectorise without reordering sums.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from observer.gaussian import add, fill, times


class Measurement(NamedTuple):
    """What is measured of (q, v), with independent noise.

    Attributes:
        rows: (M, 2J), what each measurement is of (q, v).
        value: (M,).
        variance: (M,) of the noise.
    """

    rows: Array
    value: Array
    variance: Array

    @classmethod
    def nothing(cls, joints: int) -> Self:
        """Measure nothing.

        Args:
            joints: J.

        Returns:
            M = 0 measurements.
        """
        return cls(np.zeros((0, 2 * joints)), np.zeros(0), np.zeros(0))


@kernel()
def process_noise(gain, torque, limits, motor_noise, velocity_noise):
    """Tell what a step adds to what is uncertain, contacts apart.

    Args:
        gain: (2J, J), what a torque of 1 N·m at each joint does to (q, v) in the step.
        torque: (J,) fractions of the limits.
        limits: (J,) N·m.
        motor_noise: SD of the torque as a fraction of it.
        velocity_noise: (J,) rad/s, SD of what the model leaves out.

    Returns:
        Covariance (2J, 2J).
    """
    present, joints = gain.shape
    noise = np.zeros((present, present))
    effort = np.empty(present)
    for j in range(joints):
        for i in range(present):
            effort[i] = gain[i, j] * (motor_noise * abs(torque[j]) * limits[j])
        for i in range(present):
            add(effort[i], effort, noise[i])
    for i in range(joints, present):
        noise[i, i] += velocity_noise[i - joints] ** 2
    return noise


@kernel()
def shift(mean, covariance, state, transition, noise, joints, decay, fresh):
    """Move the lagged angles on by one step, then predict.

    Args:
        mean: (S,), changed.
        covariance: (S, S), changed.
        state: (D,) that is predicted.
        transition: (D, D) ∂state/∂(the state before).
        noise: (D, D) covariance of what the step adds.
        joints: J.
        decay: (E,) what the step leaves of each error that lasts.
        fresh: (E,) rad², the variance that it adds to each.
    """
    size, dynamic = mean.size, len(state)
    present = dynamic + len(decay)
    if size > present:
        # Of the present state with the angles that are kept: now's, then the older ones.
        kept = np.empty((present, size - present))
        for i in range(present):
            for j in range(joints):
                kept[i, j] = covariance[i, j]
            for j in range(joints, size - present):
                kept[i, j] = covariance[i, present + j - joints]
        for i in range(size - 1, present + joints - 1, -1):
            mean[i] = mean[i - joints]
            for j in range(joints):
                covariance[i, present + j] = kept[j, i - present]
            for j in range(present + joints, size):
                covariance[i, j] = covariance[i - joints, j - joints]
        moved = np.empty((present, size - present))
        times(transition, kept[:dynamic], moved[:dynamic])
        for e in range(len(decay)):
            for j in range(size - present):
                moved[dynamic + e, j] = decay[e] * kept[dynamic + e, j]
        for i in range(joints):
            mean[present + i] = mean[i]
            for j in range(size - present):
                covariance[present + i, present + j] = kept[i, j]
        for i in range(present):
            for j in range(size - present):
                covariance[i, present + j] = moved[i, j]
        for i in range(size - present):
            for j in range(present):
                covariance[present + i, j] = moved[j, i]
    now, turned, moved = np.empty((dynamic, dynamic)), np.empty((dynamic, dynamic)), np.empty((dynamic, dynamic))
    fill(covariance[:dynamic, :dynamic], now)
    times(transition, now, moved)
    for i in range(dynamic):
        mean[i] = state[i]
        for j in range(dynamic):
            turned[i, j] = transition[j, i]
    times(moved, turned, now)
    for i in range(dynamic):
        for j in range(dynamic):
            covariance[i, j] = now[i, j] + noise[i, j]
    if len(decay):
        _decay(mean, covariance, transition, decay, fresh)


@kernel()
def _decay(mean, covariance, transition, decay, fresh):
    """What a step makes of the errors that last, and of their covariance with (q, v)."""
    dynamic, errors = len(transition), len(decay)
    with_state, moved = np.empty((dynamic, errors)), np.empty((dynamic, errors))
    fill(covariance[:dynamic, dynamic : dynamic + errors], with_state)
    times(transition, with_state, moved)
    for e in range(errors):
        mean[dynamic + e] *= decay[e]
        for i in range(dynamic):
            covariance[i, dynamic + e] = covariance[dynamic + e, i] = decay[e] * moved[i, e]
        for other in range(errors):
            covariance[dynamic + e, dynamic + other] *= decay[e] * decay[other]
        covariance[dynamic + e, dynamic + e] += fresh[e]


@kernel()
def condition(mean, covariance, measured, felt, felt_variance, first_error, errors):
    """Condition on what is measured, then on the felt angles: those of the present and the errors that last.

    With S = L·Lᵀ the covariance of all of it and W = L⁻¹ times its covariance with the state, P ← P - Wᵀ·W: as one
    measurement after another. The covariance is left exactly symmetric.

    Args:
        mean: (S,), changed.
        covariance: (S, S), changed.
        measured: the `Measurement` of (q, v).
        felt: (J,) rad; (0,) where no angle is.
        felt_variance: (J,) rad², of white noise.
        first_error: where the errors begin.
        errors: E.

    Returns:
        The log density of `felt` given what is `measured`.
    """
    rows, value, variance = measured
    first, joints, size, end = len(value), len(felt), mean.size, first_error + errors
    count = first + joints
    w = np.zeros((count, size))
    residual = np.empty(count)
    for m in range(first):
        residual[m] = value[m]
        for d in range(rows.shape[1]):
            if rows[m, d] != 0.0:
                residual[m] -= rows[m, d] * mean[d]
                add(rows[m, d], covariance[d], w[m])
    for j in range(joints):
        residual[first + j] = felt[j] - mean[j]
        for i in range(size):
            w[first + j, i] = covariance[j, i]
        for e in range(first_error + j, end, joints):
            residual[first + j] -= mean[e]
            add(1.0, covariance[e], w[first + j])
    total = np.empty((count, count))
    for m in range(count):
        for n in range(min(first, m + 1)):
            total[m, n] = 0.0
            for d in range(rows.shape[1]):
                total[m, n] += rows[n, d] * w[m, d]
        for n in range(first, m + 1):
            total[m, n] = w[m, n - first]
            for e in range(first_error + n - first, end, joints):
                total[m, n] += w[m, e]
        total[m, m] += variance[m] if m < first else felt_variance[m - first]
    log_density = 0.0
    for m in range(count):
        for n in range(m):  # its rows hold L by now
            for k in range(n):
                total[m, n] -= total[m, k] * total[n, k]
            total[m, n] /= total[n, n]
            total[m, m] -= total[m, n] * total[m, n]
            if total[m, n] != 0.0:
                residual[m] -= total[m, n] * residual[n]
                add(-total[m, n], w[n], w[m])
        if m >= first:
            log_density -= 0.5 * (residual[m] ** 2 / total[m, m] + np.log(2.0 * np.pi * total[m, m]))
        total[m, m] = np.sqrt(total[m, m])
        residual[m] /= total[m, m]
        for i in range(size):
            w[m, i] /= total[m, m]
        add(residual[m], w[m], mean)
    _downdate(covariance, w)
    return log_density


@kernel()
def _downdate(covariance, w):
    """P ← P - Wᵀ·W for `w` (M, S): the lower triangle, four rows of W at a time, and its mirror image."""
    count, size = w.shape
    for i in range(size):
        row = covariance[i]
        m = 0
        while m + 4 <= count:
            a, b, c, d = w[m, i], w[m + 1, i], w[m + 2, i], w[m + 3, i]
            if a == 0.0 and b == 0.0 and c == 0.0 and d == 0.0:  # of another finger
                m += 4
                continue
            w0, w1, w2, w3 = w[m], w[m + 1], w[m + 2], w[m + 3]
            for j in range(i + 1):
                row[j] -= a * w0[j] + b * w1[j] + c * w2[j] + d * w3[j]
            m += 4
        while m < count:
            a, w0 = w[m, i], w[m]
            for j in range(i + 1):
                row[j] -= a * w0[j]
            m += 1
    for i in range(size):
        for j in range(i):
            covariance[j, i] = covariance[i, j]
