"""What a trial has touched with: the links that felt something, where they were, and how surely.

A map keeps no more of a touch than the voxels it may be due to. A surface is drawn finer than these, so that the links
themselves are kept, at the pose that entered the map. Shapes: J joints, P patches, B bodies, M points of the skin, E
touches, each of one patch at one step. Lengths in metres, in the frame of the grid.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.patches import Patches, SkinPoints
from observer.jacobians import twists
from observer.kinematics import Tree

SPACING = 0.002  # m, between the points of a patch of which one has touched
MOST = 500  # touches that are looked at; of more, evenly spread ones
INDEPENDENT = 0.12  # s, after which errors of the smoothed pose are other ones
KEPT = 10_000  # links of a trial: some minutes, of which far more than `MOST` are left
RUN = 64  # links that are kept, or let go, together: all that touch at a step, several times over


class TouchingLink(NamedTuple):
    """A link of which patches were touched at a step.

    Attributes:
        patches: indices of those.
        position: (3,) m, of its frame.
        rotation: (3, 3).
        covariance: (6, 6) of how its frame is displaced and turned, m and rad.
    """

    patches: NDArray[np.int64]
    position: Array
    rotation: Array
    covariance: Array


class TouchedSkin(NamedTuple):
    """The skin of E touched patches, of which one point each has touched.

    Attributes:
        points: (M, 3) m, touch by touch.
        normals: (M, 3), out of the finger.
        variance: (M,) m², of each point along its normal.
        begin: (E,) the first point of each touch.
        alike: how many touches share one error of the pose, about.
    """

    points: Array
    normals: Array
    variance: Array
    begin: NDArray[np.int64]
    alike: float


@lru_cache(maxsize=8)
def fine_skin(patches: Patches) -> SkinPoints:
    """Spread points over the skin, close enough to tell which has touched.

    Args:
        patches: of the hand.

    Returns:
        The points, the same ones for the same patches.
    """
    return patches.surface(SPACING)


class TouchLog:
    """The touches of a trial up to some step. A later step adds to the trial's list, not to what was handed out."""

    def __init__(self, patches: Patches, rate: float, links: Sequence[TouchingLink] = ()) -> None:
        """Keep what a trial has come to.

        Args:
            patches: of the hand.
            rate: Hz, of the steps.
            links: that have touched, of which those that are there now count.
        """
        self._patches, self._rate = patches, rate
        self._links, self._count = links, len(links)

    def __len__(self) -> int:
        return self._count

    def __getstate__(self) -> dict[str, Any]:
        """What came later goes into no copy."""
        return {**vars(self), "_links": list(self._links[: self._count])}

    def since(self, count: int) -> tuple[list[TouchingLink], float]:
        """Hand out what a shorter log of the same trial does not have, so that another process can put it together.

        Args:
            count: of the links that it has.

        Returns:
            The links after those, and how many of their steps there are a second.
        """
        return list(self._links[count : self._count]), self._rate

    def continues(self, other: TouchLog) -> bool:
        """Tell whether all that another log has is in this one, at the same places.

        Args:
            other: of the same trial, or of another one.

        Returns:
            Whether `since` its length hands out the rest.
        """
        return self._links is other._links and self._count >= other._count

    def skin(self) -> TouchedSkin:
        """Place the skin that has touched.

        Returns:
            The skin of all touches; of very many, of some.
        """
        skin = fine_skin(self._patches)
        each = [(link, patch) for link in self._links[: self._count] for patch in link.patches]
        stride = -(-len(each) // MOST)
        points, normals, variance, count = [np.empty((0, 3))], [np.empty((0, 3))], [np.empty(0)], []
        for link, patch in each[:: max(stride, 1)]:
            mine = skin.patch == patch
            arm, normal = skin.points[mine] @ link.rotation.T, skin.normals[mine] @ link.rotation.T
            moves = np.hstack([normal, np.cross(arm, normal)])  # along its normal, by displacing and turning the frame
            points.append(link.position + arm)
            normals.append(normal)
            variance.append(np.einsum("mi,ij,mj->m", moves, link.covariance, moves))
            count.append(len(arm))
        begin = np.concatenate([[0], np.cumsum(count)])[:-1].astype(np.int64)
        alike = max(1.0, INDEPENDENT * self._rate / max(stride, 1))
        return TouchedSkin(np.concatenate(points), np.concatenate(normals), np.concatenate(variance), begin, alike)


class TouchRecorder:
    """Writes the log of a trial. Of a trial of hours, what is older is kept more sparsely, so that it stays small."""

    def __init__(self, hand: Hand, rate: float) -> None:
        """Begin with nothing.

        Args:
            hand: with J joints and P patches.
            rate: Hz, of the steps.
        """
        self._patches, self._bodies, self._rate = hand.patches, hand.link_bodies, rate
        self._links: list[TouchingLink] = []

    def branch(self) -> Self:
        """Branch off, so that more can be noted which this one is not to know.

        Returns:
            One that knows the same.
        """
        other = copy.copy(self)
        other._links = self._links.copy()
        return other

    def note(self, tree: Tree, frames: Any, covariance: Array, contacts: NDArray[np.bool_]) -> None:
        """Take note of a step.

        Args:
            tree: the hand's kinematics, where its root is.
            frames: `pose` (J,) rad, and `position` (B, 3) m and `rotation` (B, 3, 3) of the bodies there.
            covariance: (J, J) rad² of the pose.
            contacts: (P,) touches that tell anything new.
        """
        if len(self._links) >= KEPT:  # another list: logs that were handed out have the first one
            self._links = [each for index, each in enumerate(self._links) if index // RUN % 2]
        touched = np.flatnonzero(contacts)
        links = self._patches.link[touched]
        for link in np.unique(links):
            body = int(self._bodies[link])
            linear, angular = np.empty((len(frames.pose), 3)), np.empty((len(frames.pose), 3))
            twists(tree, frames.pose, frames.position, frames.rotation, body, linear, angular)
            moves = np.hstack([linear, angular])
            self._links.append(
                TouchingLink(
                    touched[links == link],
                    frames.position[body].copy(),
                    frames.rotation[body].copy(),
                    moves.T @ covariance @ moves,
                )
            )

    def log(self) -> TouchLog:
        """Hand out what there is.

        Returns:
            The log, which does not change.
        """
        return TouchLog(self._patches, self._rate, self._links)
