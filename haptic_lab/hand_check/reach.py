"""What a hand can explore: whether objects fit into it at rest, and whether it reaches them."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import scene, shapes, validate
from haptic_env.hand import Hand
from haptic_env.shapes import Solid
from haptic_env.touch import Touch

POSES = 1000  # drawn within the joints' ranges
MOST = 3  # patches that are named


def problems(hand: Hand, seed: int = 0) -> list[str]:
    """Look for what keeps a hand from exploring the shapes that have names.

    Args:
        hand: any.
        seed: of the poses that are tried.

    Returns:
        A line for each problem: an object that does not fit where the hand rests, and one that it never touches.
    """
    found = []
    for name in shapes.SHAPES:
        solid = shapes.usual(name, hand)
        touched, share = _tried(hand, solid, seed)
        size = f"a {name} of {1e3 * max(solid.size):.0f} mm at {[round(float(x), 3) for x in solid.position]} m"
        if touched.any():
            names = [hand.patches.names[p] for p in np.flatnonzero(touched)]
            more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
            found.append(
                f"{size} lies where the hand rests: it touches {validate.listed(names[:MOST])}{more}; open the rest "
                "pose, or move grasp_centre"
            )
        elif share == 0.0:
            found.append(f"{size} is touched in none of {POSES} poses: no finger reaches it; move grasp_centre")
    return found


def _tried(hand: Hand, solid: Solid, seed: int) -> tuple[NDArray[np.bool_], float]:
    """(P,) what touches `solid` at rest, and in which share of poses anything does."""
    model = scene.compose(hand, solid)
    data = mujoco.MjData(model)
    scene.place(model, data, solid)
    touch = Touch(hand, model, data)
    data.qpos[:] = hand.rest_pose
    mujoco.mj_forward(model, data)
    at_rest = touch.feel()
    low, high = hand.joint_limits.T
    often = 0
    for share in np.random.default_rng(seed).random((POSES, hand.joints)):
        data.qpos[:] = hand.couplings.follow(low + share * (high - low))
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        often += bool(touch.feel().any())
    return at_rest, often / POSES
