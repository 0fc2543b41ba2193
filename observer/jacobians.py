"""How points of a hand move with its joints, and how badly their places are known, compiled.

Shapes: J joints, B bodies (the world first), L links. Angles in radians, lengths in metres, in the frame of the tree
(`observer.kinematics`).
"""

from __future__ import annotations

import numpy as np

from haptic_env.compiled import kernel, part
from observer.kinematics import _times, _turn_about, body_frames


@kernel()
def point_jacobian(tree, joint_angles, position, rotation, body, point, out):
    """Find how a point that is fixed to a body moves with the joints.

    Args:
        tree: the hand's kinematics.
        joint_angles: (J,) rad.
        position: (B, 3) m of the bodies there.
        rotation: (B, 3, 3).
        body: that it is fixed to.
        point: (3,) m in the world.
        out: (3, J), filled with ∂point/∂q.
    """
    turn = np.empty((3, 3))
    back = np.empty((3, 3))
    before = np.empty((3, 3))
    anchor = np.empty(3)
    for i in range(3):
        for joint in range(len(joint_angles)):
            out[i, joint] = 0.0
    while body > 0:
        for i in range(3):
            for j in range(3):
                turn[i, j] = rotation[body, i, j]
        at0, at1, at2 = position[body, 0], position[body, 1], position[body, 2]
        # A joint is turned by those before it in the body, not by those after it: undo them from the last one on.
        for joint in range(tree.first_joint[body + 1] - 1, tree.first_joint[body] - 1, -1):
            axis0, axis1, axis2 = _turned(turn, tree.axis[joint])
            if tree.slides[joint]:
                out[0, joint], out[1, joint], out[2, joint] = axis0, axis1, axis2
                way = joint_angles[joint] - tree.zero[joint]
                at0, at1, at2 = at0 - way * axis0, at1 - way * axis1, at2 - way * axis2
                continue
            arm0, arm1, arm2 = _turned(turn, tree.anchor[joint])
            anchor[0], anchor[1], anchor[2] = at0 + arm0, at1 + arm1, at2 + arm2
            arm0, arm1, arm2 = point[0] - anchor[0], point[1] - anchor[1], point[2] - anchor[2]
            out[0, joint] = axis1 * arm2 - axis2 * arm1
            out[1, joint] = axis2 * arm0 - axis0 * arm2
            out[2, joint] = axis0 * arm1 - axis1 * arm0
            if joint == tree.first_joint[body]:
                break
            _turn_about(tree.axis[joint], tree.zero[joint] - joint_angles[joint], back)
            _times(turn, back, before)
            turn, before = before, turn
            arm0, arm1, arm2 = _turned(turn, tree.anchor[joint])
            at0, at1, at2 = anchor[0] - arm0, anchor[1] - arm1, anchor[2] - arm2
        body = tree.parent[body]


@kernel()
def twists(tree, joint_angles, position, rotation, body, linear, angular):
    """Find how the frame of a body moves with one radian a second of each joint.

    A point d m from its origin moves with linear + angular × d.

    Args:
        tree: the hand's kinematics.
        joint_angles: (J,) rad.
        position: (B, 3) m of the bodies there.
        rotation: (B, 3, 3).
        body: whose frame it is.
        linear: (J, 3) m/s, filled.
        angular: (J, 3) rad/s, filled.
    """
    jacobian, point = np.empty((3, len(joint_angles))), np.empty(3)
    for i in range(3):
        point[i] = position[body, i]
    point_jacobian(tree, joint_angles, position, rotation, body, point, jacobian)
    for joint in range(len(joint_angles)):
        for i in range(3):
            linear[joint, i] = jacobian[i, joint]
    for axis in range(2):  # angular × e_x = (0, z, -y) and angular × e_y = (-z, 0, x)
        point[axis] += 1.0
        point_jacobian(tree, joint_angles, position, rotation, body, point, jacobian)
        point[axis] -= 1.0
        for joint in range(len(joint_angles)):
            if axis == 0:
                angular[joint, 1] = linear[joint, 2] - jacobian[2, joint]
                angular[joint, 2] = jacobian[1, joint] - linear[joint, 1]
            else:
                angular[joint, 0] = jacobian[2, joint] - linear[joint, 2]


@part()
def _turned(rotation, vector):
    x, y, z = vector[0], vector[1], vector[2]
    return (
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z,
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z,
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z,
    )


@kernel()
def place_spread(tree, lengths, joint_angles, covariance, position, rotation):
    """Tell what `link_spread` does, where the frames of the bodies are known.

    Args:
        tree: the hand's kinematics.
        lengths: (L,) m of the links.
        joint_angles: (J,) rad.
        covariance: (J, J) rad² of the angles.
        position: (B, 3) m of the bodies there.
        rotation: (B, 3, 3).

    Returns:
        (L,) m.
    """
    joints = len(joint_angles)
    jacobian, middle, result = np.empty((3, joints)), np.empty(3), np.empty(len(lengths))
    for link in range(len(lengths)):
        body = tree.link_body[link]
        for i in range(3):
            middle[i] = position[body, i] + 0.5 * lengths[link] * rotation[body, i, 2]
        point_jacobian(tree, joint_angles, position, rotation, body, middle, jacobian)
        total = 0.0
        for i in range(3):
            for a in range(joints):
                if jacobian[i, a] == 0.0:
                    continue  # a joint that does not move it
                for b in range(a):
                    total += 2.0 * jacobian[i, a] * covariance[a, b] * jacobian[i, b]
                total += jacobian[i, a] * covariance[a, a] * jacobian[i, a]
        result[link] = np.sqrt(max(total, 0.0) / 3.0)
    return result


@kernel()
def link_spread(tree, lengths, joint_angles, covariance):
    """Tell how badly the place of each link is known.

    Args:
        tree: the hand's kinematics.
        lengths: (L,) m of the links.
        joint_angles: (J,) rad.
        covariance: (J, J) rad² of the angles.

    Returns:
        (L,) m, SD of the place of a link's middle along any one axis: the root mean square of three.
    """
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, joint_angles, position, rotation)
    return place_spread(tree, lengths, joint_angles, covariance, position, rotation)


@kernel()
def link_stances(tree, lengths, joint_angles, covariance, tolerance):
    """Find the frames of all links, and how far off their places may be.

    Args:
        tree: the hand's kinematics.
        lengths: (L,) m of the links.
        joint_angles: (J,) rad.
        covariance: (J, J) rad² of the angles.
        tolerance: m, of a place that is known, and the most that may add to it.

    Returns:
        (L,) m, the root of the sum of the squares of tolerance and `link_spread`; positions (L, 3) m and rotations
        (L, 3, 3).
    """
    known, most = tolerance
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, joint_angles, position, rotation)
    near = place_spread(tree, lengths, joint_angles, covariance, position, rotation)
    places, turns = np.empty((len(lengths), 3)), np.empty((len(lengths), 3, 3))
    for link in range(len(lengths)):
        near[link] = np.hypot(known, min(near[link], most))
        body = tree.link_body[link]
        for i in range(3):
            places[link, i] = position[body, i]
            for j in range(3):
                turns[link, i, j] = rotation[body, i, j]
    return near, places, turns


@kernel()
def _moving(tree, links):
    """The joints (A,) that move any of the `links` (L,) that are marked."""
    moves, count = np.zeros(len(tree.axis), dtype=np.bool_), 0
    for link in range(len(links)):
        body = tree.link_body[link] if links[link] else 0
        while body > 0:
            for joint in range(tree.first_joint[body], tree.first_joint[body + 1]):
                count += not moves[joint]
                moves[joint] = True
            body = tree.parent[body]
    result, found = np.empty(count, dtype=np.int64), 0
    for joint in range(len(moves)):
        if moves[joint]:
            result[found] = joint
            found += 1
    return result


@part()
def _moved(linear, angular, arm):
    """How a point `arm` (3,) m from the origin of a frame moves with a twist of it."""
    return (
        linear[0] + angular[1] * arm[2] - angular[2] * arm[1],
        linear[1] + angular[2] * arm[0] - angular[0] * arm[2],
        linear[2] + angular[0] * arm[1] - angular[1] * arm[0],
    )
