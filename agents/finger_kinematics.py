"""How the joints of a hand move its fingers: towards a place, and across the way there.

Shapes: J joints, L links, F fingers (links with a tip). Lengths in metres, world frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from haptic_env.hand import Hand
from haptic_env.moved import renamed
from observer.jacobians import point_jacobian
from observer.kinematics import body_frames, tree_of

LEAST = 1e-6  # metres, or metres a radian: nothing

__getattr__ = renamed(__name__, {"Reach": "FingerKinematics"})


class Strokes(NamedTuple):
    """Torques, as fractions in [-1, 1], that move each finger one way; 0 for joints that do not move it.

    All but `close` are also 0 for joints that move several fingers.

    Attributes:
        close: (F, J), close it about a place.
        across: (F, J), move it across the way there.
        curl: (F, J), its inner joints away from the place and its outer ones towards it, which draws the tip along what
            it touches.
    """

    close: Array
    across: Array
    curl: Array


class FingerKinematics:
    """The kinematics of a hand's fingers, for policies.

    Attributes:
        moves: (F, J): which joints move each finger.
        alone: (F, J): which joints move that finger alone; those of a wrist move several.
        links: (F, L): the links of each finger; a palm belongs to none.
    """

    def __init__(self, hand: Hand) -> None:
        """Find which joints move which finger.

        Args:
            hand: with F fingers.
        """
        self._tree = tree_of(hand)
        self._middle = np.array([0.5 * link.length for link in hand.links])
        self._tips = np.flatnonzero([link.tip for link in hand.links])
        _, jacobian = self._points(hand.rest_pose, self._middle)
        moved = np.abs(jacobian).max(axis=1) > LEAST  # (L, J)
        self.moves: NDArray[np.bool_] = moved[self._tips]
        self.alone: NDArray[np.bool_] = self.moves & (self.moves.sum(axis=0) == 1)
        self.links: NDArray[np.bool_] = (moved[None] & self.alone[:, None]).any(axis=2)
        order = np.cumsum(self.alone, axis=1)
        self._outer = order > 0.5 * order[:, -1:]

    @property
    def fingers(self) -> int:
        """F."""
        return len(self._tips)

    def strokes(self, joint_angles: ArrayLike, place: ArrayLike) -> Strokes:
        """Find the strokes about a place.

        `close` is for each joint the cosine between the way in which it moves the links of the finger and their way to
        the place, averaged over the links by how far it moves them.

        Args:
            joint_angles: (J,) rad.
            place: (3,) m, or one for each finger (F, 3).

        Returns:
            The strokes.
        """
        points, jacobian = self._points(joint_angles, self._middle)
        joint, _ = self._points(joint_angles, np.zeros_like(self._middle))
        places = np.broadcast_to(np.asarray(place, dtype=np.float64), (self.fingers, 3))
        way = places[:, None] - points  # (F, L, 3)
        way /= np.maximum(np.linalg.norm(way, axis=2, keepdims=True), LEAST)
        length = np.linalg.norm(jacobian, axis=1) * self.links[:, :, None]  # (F, L, J)
        pull = np.einsum("lij,fli,fl->fj", jacobian, way, self.links)
        close = self.moves * pull / np.maximum(length.sum(axis=1), LEAST)
        each = np.arange(self.fingers)
        tip = jacobian[self._tips]  # (F, 3, J)
        sideways = np.cross(way[each, self._tips], (points - joint)[self._tips])
        sideways /= np.maximum(np.linalg.norm(sideways, axis=1, keepdims=True), LEAST)
        across = np.einsum("fij,fi->fj", tip, sideways) / np.maximum(np.linalg.norm(tip, axis=1), LEAST)
        return Strokes(close, self.alone * across, self.alone * np.where(self._outer, close, -close))

    def together(self, torques: Array) -> NDArray[np.float32]:
        """Sum the torques of all fingers, averaged where several move a joint.

        Args:
            torques: (F, J), fractions.

        Returns:
            (J,) in [-1, 1].
        """
        return np.clip(torques.sum(axis=0) / np.maximum(self.moves.sum(axis=0), 1), -1.0, 1.0).astype(np.float32)

    def touching(self, hand: Hand, contacts: ArrayLike) -> NDArray[np.bool_]:
        """Tell which fingers feel contact.

        Args:
            hand: the same.
            contacts: (P,).

        Returns:
            (F,).
        """
        felt = np.zeros(len(hand.links), dtype=bool)
        felt[hand.patches.link[np.flatnonzero(contacts)]] = True
        return self.links @ felt

    def _points(self, joint_angles: ArrayLike, along: Array) -> tuple[Array, Array]:
        """(L, 3) m, the points `along` (L,) m the bones, and (L, 3, J), how the joints move them."""
        q = np.asarray(joint_angles, dtype=np.float64)
        points, jacobian = np.empty((len(along), 3)), np.empty((len(along), 3, len(q)))
        _points_on_bones(self._tree, q, along, points, jacobian)
        return points, jacobian


@kernel()
def _points_on_bones(tree, joint_angles, along, points, jacobian):
    """Fill `points` (L, 3) and `jacobian` (L, 3, J) for the place `along` (L,) m each link's bone."""
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, joint_angles, position, rotation)
    for link in range(len(along)):
        body = tree.link_body[link]
        for i in range(3):
            points[link, i] = position[body, i] + along[link] * rotation[body, i, 2]
        point_jacobian(tree, joint_angles, position, rotation, body, points[link], jacobian[link])
