"""Which links have something to say to a map that is news.

Shapes: L links, P patches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.hand import Hand
from observer.maps.mean_frames import MeanFrames
from observer.novelty import LinkHistory, note

ALIKE = 0.6  # voxels: what a link says of them from places further apart is news to a map
FEW, MOSTLY = 0.05, 0.5  # share of it that is not worth weighing, and that from which on a map takes all in


class MapNovelty:
    """Which links have something to say to a map that they have not said from the same place already."""

    def __init__(self, hand: Hand, repeats: float, resolution: float) -> None:
        """`repeats` as in `ContactModel`; `resolution` m of the map."""
        self._hand = hand
        self._share = 1.0 / repeats if repeats else 0.0  # of all that can be said at one place
        self._alike = np.full(len(hand.links), ALIKE * resolution)
        self.reset()

    def reset(self) -> None:
        """Start a trial: all is news."""
        self._said, self._news = LinkHistory.nothing(self._hand), np.ones(len(self._hand.links))

    def heard(self, stance: MeanFrames, contacts: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(L,) whether a map takes in what each link of a hand that stands so says, feeling `contacts` (P,)."""
        if self._share:
            body = self._hand.link_bodies
            frames = stance.position[body], stance.rotation[body]
            note(self._said, *frames, contacts, self._alike, self._share, FEW, self._news)
        return self._news > MOSTLY
