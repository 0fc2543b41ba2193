"""The compiled parts of the pose filter: move on, condition, and what contacts do. All work in place.

Shapes: J joints, D numbers of state, (q, v) and, where forces last, the joints' torques by them, E numbers of errors
that last, S = D + E + T·J numbers of the filter with T steps of lag, M measurements, P patches, B bodies. Loops over
the last axis are plain, so that they vectorise without reordering sums.
"""

from __future__ import annotations

import numpy as np

from haptic_env.compiled import kernel
from observer.gaussian import add, fill, times
from observer.kinematics import body_frames, point_jacobian


@kernel()
def process_noise(gain, torque, limits, motor_noise, velocity_noise):
    """Covariance (2J, 2J) of what a step adds: motor noise, a fraction of the `torque` (J,), itself a fraction of its
    `limits` (J,), through `gain` (2J, J), and `velocity_noise` in rad/s."""
    present, joints = gain.shape
    noise = np.zeros((present, present))
    effort = np.empty(present)
    for j in range(joints):
        for i in range(present):
            effort[i] = gain[i, j] * (motor_noise * abs(torque[j]) * limits[j])
        for i in range(present):
            add(effort[i], effort, noise[i])
    for i in range(joints, present):
        noise[i, i] += velocity_noise**2
    return noise


@kernel()
def shift(mean, covariance, state, transition, noise, joints, decay, fresh):
    """Move the lagged angles on by one step, then predict: `state` (D,), `transition` and `noise` (D, D); of each error
    that lasts `decay` (E,) is left, and a variance `fresh` (E,) is added."""
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
def condition(mean, covariance, rows, value, variance, felt, felt_variance, first_error, errors):
    """Condition on what is measured: first M `rows` (M, 2J) of (q, v) with `value` (M,) and `variance` (M,), then what
    is `felt` (J,) with `felt_variance` (J,): the present angles and the errors that last, `errors` numbers from
    `first_error` on. Leaves the covariance exactly symmetric.

    Returns the log density of `felt` given the rows before it. With S = L·Lᵀ the covariance of all that is measured
    and W = L⁻¹ times their covariance with the state, P ← P - Wᵀ·W: as one measurement after another.
    """
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


@kernel()
def contact_effects(tree, q, gain, body, point, axes, force, lasting, felt, noise, along):
    """Add to `noise` (D, D) what unknown forces on the F patches `felt` do, and fill `along` (F, 3, J), the speed of
    their skin along each axis by joint speed. To forces that last, which move the joints from the next step on, a step
    adds `lasting` times as much.

    `gain` (2J, J) by joint torque; for each patch (P,): `body`, `point` (P, 3) m and `axes` (P, 3, 3), rows, in the
    body's frame, and `force` (P, 3) N, the SD along each axis.
    """
    joints = len(q)
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    place = np.empty(3)
    axis = np.empty(3)
    jacobian = np.empty((3, joints))
    pushed = np.empty(2 * joints)
    body_frames(tree, q, position, rotation)
    for f in range(len(felt)):
        patch = felt[f]
        frame = rotation[body[patch]]
        for i in range(3):
            place[i] = position[body[patch], i]
            for k in range(3):
                place[i] += frame[i, k] * point[patch, k]
        point_jacobian(tree, q, position, rotation, body[patch], place, jacobian)
        for a in range(3):
            for i in range(3):
                axis[i] = 0.0
                for k in range(3):
                    axis[i] += frame[i, k] * axes[patch, a, k]
            for j in range(joints):
                along[f, a, j] = axis[0] * jacobian[0, j] + axis[1] * jacobian[1, j] + axis[2] * jacobian[2, j]
            for i in range(2 * joints):
                pushed[i] = 0.0
                for j in range(joints):
                    pushed[i] += gain[i, j] * along[f, a, j]
                pushed[i] *= force[patch, a]
            for i in range(2 * joints):
                add(pushed[i], pushed, noise[i, : 2 * joints])
            if lasting > 0.0:
                for i in range(joints):
                    add(
                        along[f, a, i] * (lasting * force[patch, a]) ** 2,
                        along[f, a],
                        noise[2 * joints + i, 2 * joints :],
                    )
