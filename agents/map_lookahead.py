"""What a map is expected to gain from moving the hand. No shape is assumed.

Shapes: M candidate torques, T looks, F fingers, J joints, D = 2J, S points of the skin, (X, Y, Z) voxels.
"""

from __future__ import annotations

import numpy as np

from agents.finger_kinematics import FingerKinematics
from agents.rollouts import Line
from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from observer.kinematics import body_frames, tree_of
from observer.maps.capsules import lattice_of, voxel_of
from observer.maps.contact_model import ContactModel

SPACING = 0.006  # metres between points of the skin


class MapLookahead:
    """The expected drop of a map's entropy.

    A finger sweeps cells as it moves in free air, and learns of each what it holds: the entropy of the cell. It goes on
    only as long as none of them has stopped it; solid cells lie together, so that of each look the most probable one
    counts. A cell of which nothing is known is as probably solid as the observer's prior has it.
    """

    def __init__(self, hand: Hand) -> None:
        """Place points on the hand.

        Args:
            hand: whose map it is.
        """
        skin = hand.patches.surface(SPACING)
        self._tree = tree_of(hand)
        self._points, self._body = skin.points, hand.link_bodies[skin.link].astype(np.int64)
        kinematics = FingerKinematics(hand)
        on_finger = kinematics.links.any(axis=0)
        finger = np.where(on_finger, kinematics.links.argmax(axis=0), kinematics.fingers)  # what is on none is a palm
        self._finger = finger[skin.link].astype(np.int64)

    def gain(self, occupancy: Array, grid: Grid, line: Line, push: Array, looks: int, every: int) -> Array:
        """Weigh torques by what they are expected to tell of the map.

        Args:
            occupancy: (X, Y, Z) probabilities, the map of now.
            grid: of it.
            line: the forward model about now.
            push: (M, J) N·m, beyond the torques of now.
            looks: how often is looked at the pose.
            every: control steps from one look to the next.

        Returns:
            (M,) bits.
        """
        solid = np.where(occupancy == 0.5, ContactModel.prior, occupancy)
        p = np.clip(occupancy, 1e-9, 1.0 - 1e-9)
        entropy = -p * np.log2(p) - (1.0 - p) * np.log2(1.0 - p)
        now = np.broadcast_to(line.state[: push.shape[1]], (len(push), 1, push.shape[1]))
        poses = np.concatenate([now, _swing(line, push, looks, every)], axis=1)
        return np.asarray(
            expected(
                self._tree,
                self._points,
                self._body,
                self._finger,
                poses,
                lattice_of(grid),
                entropy,
                np.log1p(-np.minimum(solid, 1.0 - 1e-9)),
            )
        )


def _swing(line: Line, push: Array, looks: int, every: int) -> Array:
    """(M, T, J) rad: where each of `push` (M, J) N·m takes the hand in free air."""
    joints = push.shape[1]
    x = np.tile(line.state, (len(push), 1))
    poses = np.empty((len(push), looks, joints))
    for step in range(looks * every):
        x = line.drift + (x - line.state) @ line.transition.T + push @ line.gain.T
        inside = np.clip(x[:, :joints], line.low, line.high)
        x[:, joints:] *= inside == x[:, :joints]
        x[:, :joints] = inside
        if (step + 1) % every == 0:
            poses[:, step // every] = inside
    return poses


@kernel()
def expected(tree, points, body, finger, poses, lattice, entropy, log_empty):
    """Sum the entropy of the cells that paths sweep, each once, by the probability that the finger gets there.

    Args:
        tree: the hand's kinematics.
        points: (K, 3) m on the skin, each in its body's frame.
        body: (K,) index.
        finger: (K,) index.
        poses: (M, 1 + T, J) rad, each path from where the hand is now.
        lattice: the grid.
        entropy: (X, Y, Z) bits of each cell.
        log_empty: (X, Y, Z) log probability that each is empty.

    Returns:
        (M,) bits.
    """
    out, at = np.zeros(len(poses)), np.empty(3)
    for m in range(len(poses)):
        position, rotation = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
        swept = np.zeros(entropy.shape, dtype=np.bool_)
        passes = np.zeros(finger.max() + 1)  # log of the probability that nothing has stopped the finger
        here = np.zeros(len(passes))
        for t in range(poses.shape[1]):
            body_frames(tree, poses[m, t], position, rotation)
            here[:] = 0.0
            for s in range(len(points)):
                b = body[s]
                x, y, z = points[s, 0], points[s, 1], points[s, 2]
                for i in range(3):
                    at[i] = position[b, i] + rotation[b, i, 0] * x + rotation[b, i, 1] * y + rotation[b, i, 2] * z
                i, j, k, inside = voxel_of(lattice, at[0], at[1], at[2])
                if not inside or swept[i, j, k]:
                    continue
                swept[i, j, k] = True
                if t > 0:
                    out[m] += np.exp(passes[finger[s]]) * entropy[i, j, k]
                    here[finger[s]] = min(here[finger[s]], log_empty[i, j, k])
            passes += here
    return out
