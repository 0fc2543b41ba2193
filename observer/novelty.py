"""What links have said already, so that what they repeat is not taken for news.

Shapes: L links, M looks that are kept of each, P patches. Lengths in metres, in the frame of the object.

What a link feels is never weighed quite as it should be: the pose is off by something, skin and solid are not quite as
they are drawn, voxels are coarse. From one place that error is always the same, so that a hand that rests, or comes
back to where it was, would grow ever surer of it. What can be felt at one place therefore has a budget: looks that are
alike share an exponent of one, however many they are. Two looks are alike as far as exp(-d² / 2a²) goes, d being how
far apart they find the link (root mean square of both ends of its bone) and `a` what is alike, and by the share of the
patches in contact that they have in common (Jaccard 1912, New Phytologist 11(2), 37-50). It is the first order of what
a Gaussian process of that covariance takes for news (Rasmussen & Williams 2006, section 2.2). `note` in
`observer.shape_kernels` keeps the account.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from haptic_env.hand import Hand
from observer.capsules import Stance
from observer.shape_kernels import note

KEPT = 1024  # looks of a link that said something new; the oldest are forgotten
ALIKE = 0.6  # voxels: what a link says of them from places further apart is news to a map
LITTLE = 0.001  # share of what a link says that is not worth weighing
FEW, MOSTLY = 0.05, 0.5  # the same for a map, and the share of news from which on it takes all in


class Said(NamedTuple):
    """The `place` (L, M, 6) m of each look, both ends of the link's bone, and the `exponent` (L, M) with which it
    counts; what was felt, `contacts` (M, P), each link's in the columns of its patches, and how many of them did,
    `touches` (L, M). `looks` (L,): how many there were, the last one at (looks - 1) % M. The `length` (L,) m of the
    bones; the patches of link l are `first_patch[l]` up to `first_patch[l + 1]`."""

    place: NDArray[np.float64]
    exponent: NDArray[np.float64]
    contacts: NDArray[np.bool_]
    touches: NDArray[np.int64]
    looks: NDArray[np.int64]
    length: NDArray[np.float64]
    first_patch: NDArray[np.int64]

    @classmethod
    def nothing(cls, hand: Hand, kept: int = KEPT) -> Self:
        """Before the first look of `hand`; of each link so many are `kept`."""
        links = len(hand.links)
        return cls(
            np.zeros((links, kept, 6)),
            np.zeros((links, kept)),
            np.zeros((kept, len(hand.patches)), dtype=np.bool_),
            np.zeros((links, kept), dtype=np.int64),
            np.zeros(links, dtype=np.int64),
            np.array([link.length for link in hand.links]),
            np.searchsorted(hand.patches.link, np.arange(links + 1)).astype(np.int64),
        )


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
        self._said, self._news = Said.nothing(self._hand), np.ones(len(self._hand.links))

    def heard(self, stance: Stance, contacts: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(L,) whether a map takes in what each link of a hand that stands so says, feeling `contacts` (P,)."""
        if self._share:
            body = self._hand.link_bodies
            frames = stance.position[body], stance.rotation[body]
            note(self._said, *frames, contacts, self._alike, self._share, FEW, self._news)
        return self._news > MOSTLY
