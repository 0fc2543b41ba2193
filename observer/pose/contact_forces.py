"""What unknown forces on the skin do to a hand, compiled.

Shapes: J joints, D numbers of the filter's state (`observer.pose.kalman`), P patches, F of them in contact, B bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from observer.gaussian import add
from observer.jacobians import point_jacobian
from observer.kinematics import body_frames


class PatchForces(NamedTuple):
    """Where forces may act on the skin, and how strongly.

    Attributes:
        body: (P,) that each patch is on.
        point: (P, 3) m, its middle, in the body's frame.
        axes: (P, 3, 3), along which forces are independent: rows, in the body's frame.
        force: (P, 3) N, the SD along each.
    """

    body: NDArray[np.integer]
    point: Array
    axes: Array
    force: Array


@kernel()
def contact_effects(tree, q, gain, forces, lasting, felt, noise, along):
    """Tell what unknown forces on the skin do, and how the skin moves where they act.

    Args:
        tree: the hand's kinematics.
        q: (J,) rad.
        gain: (2J, J), what a torque of 1 N·m at each joint does to (q, v) in the step.
        forces: the `PatchForces`.
        lasting: times as much a step adds to the forces that last, which move the joints from the next step on.
        felt: (F,) the patches in contact.
        noise: (D, D) covariance of what the step adds, to which that of the forces is added.
        along: (F, 3, J) m, filled: the speed of each patch's skin along each of its axes by joint speed.
    """
    body, point, axes, force = forces
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
