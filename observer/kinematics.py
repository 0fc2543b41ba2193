"""Forward kinematics of any tree of hinges and slides, compiled.

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
from haptic_env.moved import renamed
from haptic_env.pose import Pose

__getattr__ = renamed(
    __name__,
    {name: f"observer.jacobians.{name}" for name in ("link_spread", "place_spread", "point_jacobian", "twists")},
)


class Tree(NamedTuple):
    """What forward kinematics needs of a hand, parents before children.

    Attributes:
        parent: (B,) of each body.
        offset: (B, 3) m, where each body is in its parent.
        rotation: (B, 3, 3), how it is turned there.
        first_joint: (B + 1,), its joints being `first_joint[b]` up to `first_joint[b + 1]`.
        slides: (J,) whether each joint slides along its axis; the others turn about it.
        axis: (J, 3) of each joint, in its body: of unit length, or m in one radian of what slides.
        anchor: (J, 3) m, likewise.
        zero: (J,) rad, the angle at which the tree was drawn.
        link_body: (L,) the body of each link.
    """

    parent: NDArray[np.int64]
    offset: NDArray[np.float64]
    rotation: NDArray[np.float64]
    first_joint: NDArray[np.int64]
    slides: NDArray[np.bool_]
    axis: NDArray[np.float64]
    anchor: NDArray[np.float64]
    zero: NDArray[np.float64]
    link_body: NDArray[np.int64]


def tree_of(hand: Hand) -> Tree:
    """Read the tree of a hand from its model.

    Args:
        hand: with J joints and L links.

    Returns:
        Its tree, in the frame in which the hand is drawn.

    Raises:
        ValueError: where a joint is no hinge, nor a slide with a lever arm (`haptic_env.sliding`).
    """
    model = hand.model
    for joint in range(model.njnt):
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE and hand.lever_arms[joint] <= 0.0:
            raise ValueError(
                f"joint {model.joint(joint).name!r} of hand {hand.name!r} is not a hinge, nor a slide with a lever arm"
            )
    rotation = np.empty((model.nbody, 9))
    for body in range(model.nbody):
        mujoco.mju_quat2Mat(rotation[body], model.body_quat[body])
    return Tree(
        parent=model.body_parentid.astype(np.int64),
        offset=model.body_pos.copy(),
        rotation=rotation.reshape(-1, 3, 3),
        first_joint=np.concatenate([[0], np.cumsum(model.body_jntnum)]).astype(np.int64),
        slides=hand.lever_arms > 0.0,
        axis=model.jnt_axis.copy(),
        anchor=model.jnt_pos.copy(),
        zero=model.qpos0.copy(),
        link_body=hand.link_bodies.astype(np.int64),
    )


def placed(tree: Tree, root: Pose | None) -> Tree:
    """Move a hand as a whole.

    Args:
        tree: its kinematics.
        root: the pose of its world in another frame; None: it is that frame.

    Returns:
        The tree with all that is fixed to its world moved.
    """
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
    """Find the frames of all bodies.

    Args:
        tree: the hand's kinematics.
        joint_angles: (J,) rad.
        position: (B, 3) m, filled.
        rotation: (B, 3, 3), filled.
    """
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
            if tree.slides[joint]:
                axis, way = tree.axis[joint], joint_angles[joint] - tree.zero[joint]
                for i in range(3):
                    along = (
                        rotation[body, i, 0] * axis[0] + rotation[body, i, 1] * axis[1] + rotation[body, i, 2] * axis[2]
                    )
                    position[body, i] += way * along
                continue
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
    """Find the frames of all links.

    Args:
        tree: the hand's kinematics.
        joint_angles: (J,) rad.

    Returns:
        Positions (L, 3) m and rotations (L, 3, 3) in the world.

    Raises:
        ValueError: where angles are not finite.
    """
    angles = validate.array("joint_angles", joint_angles, tree.zero.shape, "radians")
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, angles, position, rotation)
    return position[tree.link_body], rotation[tree.link_body]


@kernel()
def placed_points(tree, joint_angles, points, link):
    """Find where points that are fixed to links lie.

    Args:
        tree: the hand's kinematics.
        joint_angles: (J,) rad.
        points: (M, 3) m, each in the frame of its link.
        link: (M,).

    Returns:
        (M, 3) m in the world.
    """
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
