"""In which directions a hand has felt something, and with which places of it.

Shapes: D directions, M places, K patches. Lengths in metres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.shapes.sphere_points import directions
from observer.kinematics import placed_points, tree_of

DIRECTIONS, PLACES = 400, 500  # D, M


class Record(NamedTuple):
    """What was touched so far.

    Attributes:
        felt: (D,) touches in each direction from the grasp centre.
        places: (M, 3) m, where the skin was when it touched, in the frame of the hand that is turned to its side.
        touches: how many of these there were; the last M are kept.
    """

    felt: Array
    places: Array
    touches: Array

    @classmethod
    def empty(cls) -> Record:
        """Begin with nothing."""
        return cls(np.zeros(DIRECTIONS), np.zeros((PLACES, 3)), np.array(0))

    def recent(self, count: int) -> Array:
        """Look up the last places.

        Args:
            count: how many at most.

        Returns:
            (K, 3) m.
        """
        known = min(count, int(self.touches), PLACES)
        return self.places[(int(self.touches) - 1 - np.arange(known)) % PLACES]


class TouchRecorder:
    """Keeps the record of a hand.

    Attributes:
        directions: (D, 3).
    """

    def __init__(self, hand: Hand) -> None:
        """Spread the directions.

        Args:
            hand: that touches.
        """
        self._hand, self._tree = hand, tree_of(hand)
        self.directions = directions(DIRECTIONS)
        self._near = cKDTree(self.directions)

    def noted(self, record: Record, side: tuple[Rotation, Array], pose: Array, patches: NDArray[np.int64]) -> Record:
        """Add to a record.

        Args:
            record: so far, which is not changed.
            side: how the hand is turned and shifted (3,) m.
            pose: (J,) rad, where it is believed to be.
            patches: (K,) that feel something.

        Returns:
            The record with it.
        """
        if patches.size == 0:
            return record
        skin = self._hand.patches
        away = placed_points(self._tree, pose, skin.position[patches], skin.link[patches]) - self._hand.grasp_centre
        felt, places = record.felt.copy(), record.places.copy()
        np.add.at(felt, self.nearest(away), 1.0)
        turn, shift = side
        index = (int(record.touches) + np.arange(patches.size)) % PLACES
        places[index] = turn.inv().apply(away - shift)
        return Record(felt, places, record.touches + patches.size)

    def nearest(self, away: Array) -> NDArray[np.int64]:
        """Find directions.

        Args:
            away: (..., 3) m from the grasp centre.

        Returns:
            (...,) the index of the direction in which each lies.
        """
        distance = np.linalg.norm(away, axis=-1, keepdims=True)
        return np.asarray(self._near.query(away / np.maximum(distance, 1e-9))[1])
