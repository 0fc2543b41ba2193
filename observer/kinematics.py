"""Forward kinematics of any tree of hinges, compiled.

Shapes: J joints, B bodies (the world first), L links. Angles in radians, lengths in metres, in the world frame of the
hand or, once the tree is `placed`, in another.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.compiled import kernel, part
from haptic_env.hand import Hand
from haptic_env.pose import Pose


class Tree(NamedTuple):
    """What forward kinematics needs of a hand, parents before children.

    `parent` (B,), `offset` (B, 3) and `rotation` (B, 3, 3) of each body in its parent; its joints are
    `first_joint[b]` up to `first_joint[b + 1]`; `axis` (J, 3) and `anchor` (J, 3) in the body, `zero` (J,) the angle
    at which the tree was drawn; `link_body` (L,).
    """

    parent: NDArray[np.int64]
    offset: NDArray[np.float64]
    rotation: NDArray[np.float64]
    first_joint: NDArray[np.int64]
    axis: NDArray[np.float64]
    anchor: NDArray[np.float64]
    zero: NDArray[np.float64]
    link_body: NDArray[np.int64]


def tree_of(hand: Hand) -> Tree:
    """Read the tree of `hand` from its model; raises `ValueError` where a joint is no hinge."""
    model = hand.model
    for joint in range(model.njnt):
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
            raise ValueError(f"joint {model.joint(joint).name!r} of hand {hand.name!r} is not a hinge")
    rotation = np.empty((model.nbody, 9))
    for body in range(model.nbody):
        mujoco.mju_quat2Mat(rotation[body], model.body_quat[body])
    return Tree(
        parent=model.body_parentid.astype(np.int64),
        offset=model.body_pos.copy(),
        rotation=rotation.reshape(-1, 3, 3),
        first_joint=np.concatenate([[0], np.cumsum(model.body_jntnum)]).astype(np.int64),
        axis=model.jnt_axis.copy(),
        anchor=model.jnt_pos.copy(),
        zero=model.qpos0.copy(),
        link_body=hand.link_bodies.astype(np.int64),
    )


def placed(tree: Tree, root: Pose | None) -> Tree:
    """`tree` with all that is fixed to its world moved to `root`, the pose of that world in another frame."""
    if root is None:
        return tree
    offset, rotation = tree.offset.copy(), tree.rotation.copy()
    for body in range(1, len(tree.parent)):
        if tree.parent[body] == 0:
            offset[body] = root.position + root.rotation @ tree.offset[body]
            rotation[body] = root.rotation @ tree.rotation[body]
    return tree._replace(offset=offset, rotation=rotation)


@part()
def _turn_about(axis, angle, out):
    """Rotation matrix about a unit `axis` (3,) (Rodrigues)."""
    s, c = np.sin(angle), np.cos(angle)
    x, y, z = axis
    t = 1.0 - c
    out[0, 0] = t * x * x + c
    out[0, 1] = t * x * y - s * z
    out[0, 2] = t * x * z + s * y
    out[1, 0] = t * x * y + s * z
    out[1, 1] = t * y * y + c
    out[1, 2] = t * y * z - s * x
    out[2, 0] = t * x * z - s * y
    out[2, 1] = t * y * z + s * x
    out[2, 2] = t * z * z + c


@part()
def _times(a, b, out):
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@kernel()
def body_frames(tree, joint_angles, position, rotation):
    """Fill `position` (B, 3) and `rotation` (B, 3, 3) with the world frames of all bodies at `joint_angles` (J,)."""
    turn = np.empty((3, 3))
    turned = np.empty((3, 3))
    for i in range(3):
        position[0, i] = 0.0
        for j in range(3):
            rotation[0, i, j] = 1.0 if i == j else 0.0
    for body in range(1, len(tree.parent)):
        up = tree.parent[body]
        for i in range(3):
            position[body, i] = position[up, i] + (
                rotation[up, i, 0] * tree.offset[body, 0]
                + rotation[up, i, 1] * tree.offset[body, 1]
                + rotation[up, i, 2] * tree.offset[body, 2]
            )
        _times(rotation[up], tree.rotation[body], rotation[body])
        for joint in range(tree.first_joint[body], tree.first_joint[body + 1]):
            _turn_about(tree.axis[joint], joint_angles[joint] - tree.zero[joint], turn)
            _times(rotation[body], turn, turned)
            anchor = tree.anchor[joint]
            for i in range(3):
                # The anchor stays where it is while the body turns about it.
                position[body, i] += (
                    (rotation[body, i, 0] - turned[i, 0]) * anchor[0]
                    + (rotation[body, i, 1] - turned[i, 1]) * anchor[1]
                    + (rotation[body, i, 2] - turned[i, 2]) * anchor[2]
                )
            for i in range(3):
                for j in range(3):
                    rotation[body, i, j] = turned[i, j]


def link_frames(tree: Tree, joint_angles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """World positions (L, 3) and rotations (L, 3, 3) of all links at `joint_angles` (J,); raises `ValueError` where
    those are not finite."""
    angles = validate.array("joint_angles", joint_angles, tree.zero.shape, "radians")
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, angles, position, rotation)
    return position[tree.link_body], rotation[tree.link_body]


@kernel()
def placed_points(tree, joint_angles, points, link):
    """World positions (M, 3) m of `points` (M, 3), each in the frame of its `link` (M,), at `joint_angles` (J,)."""
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, joint_angles, position, rotation)
    result = np.empty((len(points), 3))
    for m in range(len(points)):
        body = tree.link_body[link[m]]
        for i in range(3):
            result[m, i] = position[body, i]
            for k in range(3):
                result[m, i] += rotation[body, i, k] * points[m, k]
    return result


@kernel()
def point_jacobian(tree, joint_angles, position, rotation, body, point, out):
    """Fill `out` (3, J) with ∂point/∂q of a `point` (3,) m fixed to `body`, at the frames of `joint_angles` (J,)."""
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
    """Fill `linear` and `angular` (J, 3) with what one radian a second of each joint does to the frame of `body`, at
    the frames of `joint_angles` (J,): a point d m from its origin moves with linear + angular × d."""
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
    """What `link_spread` says (L,), at the frames of `joint_angles` (J,)."""
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
    """SD (L,) m of the place of the middle of each link, of `lengths` (L,) m, along any one axis, for angles of
    `covariance` (J, J) rad² about `joint_angles` (J,)."""
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, joint_angles, position, rotation)
    return place_spread(tree, lengths, joint_angles, covariance, position, rotation)


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
