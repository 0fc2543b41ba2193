"""What links have said already, so that what they repeat is not taken for news.

Shapes: L links, M looks that are kept of each, P patches. Lengths in metres, in the frame of the object.

What a link feels is never weighed quite as it should be: the pose is off by something, skin and solid are not quite as
they are drawn, voxels are coarse. From one place that error is always the same, so that a hand that rests, or comes
back to where it was, would grow ever surer of it. What can be felt at one place therefore has a budget: looks that are
alike share an exponent of one, however many they are. Two looks are alike as far as exp(-d² / 2a²) goes, d being how
far apart they find the link (root mean square of both ends of its bone) and `a` what is alike, and by the share of the
patches in contact that they have in common (Jaccard 1912, New Phytologist 11(2), 37-50). It is the first order of what
a Gaussian process of that covariance takes for news (Rasmussen & Williams 2006, section 2.2). `note` keeps the
account.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import inner, kernel
from haptic_env.hand import Hand
from haptic_env.moved import renamed

__getattr__ = renamed(__name__, {"Said": "LinkHistory"})

APART = 3.0  # in units of what is alike: from places further apart nothing is said again

KEPT = 1024  # looks of a link that said something new; the oldest are forgotten
LITTLE = 0.001  # share of what a link says that is not worth weighing


class LinkHistory(NamedTuple):
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


@inner()
def repeated(said, link, place, contacts, touches, alike):
    """Exponent with which `link` has `said` before what it says at `place` (6,) m while its patches feel `contacts`
    (P,), `touches` of them: of each look the share that says the same (`observer.novelty`); places are some `alike` m
    apart."""
    total, most = 0.0, 2.0 * (APART * alike) ** 2
    for look in range(min(said.looks[link], len(said.contacts))):
        square = 0.0
        for i in range(6):
            square += (said.place[link, look, i] - place[i]) ** 2
        if square > most:
            continue
        same, either = 1.0, touches + said.touches[link, look]
        if either > 0:
            both = 0
            if touches > 0 and said.touches[link, look] > 0:
                for patch in range(said.first_patch[link], said.first_patch[link + 1]):
                    both += contacts[patch] and said.contacts[look, patch]
            same = both / (either - both)
        total += said.exponent[link, look] * same * np.exp(-0.25 * square / alike**2)
    return total


@inner()
def ends(length, position, rotation, place):
    """Fill `place` (6,) m with both ends of a bone of `length` m that begins at `position` (3,) m and lies along the z
    axis of `rotation` (3, 3)."""
    for i in range(3):
        place[i] = position[i]
        place[3 + i] = position[i] + length * rotation[i, 2]


@kernel()
def note(said, position, rotation, contacts, alike, temper, least, news):
    """Fill `news` (L,) with how much of what each link says is new, 1 for all of it, at `position` (L, 3) m and
    `rotation` (L, 3, 3) and with `contacts` (P,); looks from places some `alike` (L,) m apart say the same. It is noted
    in `said`, with the exponent `temper` as far as it is new, so that like looks together have at most 1; up to `least`
    it is no news at all."""
    place = np.empty(6)
    for link in range(len(news)):
        first, end = said.first_patch[link], said.first_patch[link + 1]
        ends(said.length[link], position[link], rotation[link], place)
        touches = 0
        for patch in range(first, end):
            touches += contacts[patch]
        new = 1.0 - repeated(said, link, place, contacts, touches, alike[link])
        news[link] = new if new > least else 0.0
        if news[link] == 0.0:
            continue
        look = said.looks[link] % len(said.contacts)
        for i in range(6):
            said.place[link, look, i] = place[i]
        for patch in range(first, end):
            said.contacts[look, patch] = contacts[patch]
        said.touches[link, look] = touches
        said.exponent[link, look] = temper * new
        said.looks[link] += 1
