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

The error of the pose wanders as well, wherever the hand goes, so that of a touch that lasts the first look says more
than those after it. Told how long it does (`lasting`, tau), looks are alike in time, too: as far as exp(-t / tau), t
being the time between them, where that is more than what their places say.
"""

from __future__ import annotations

import copy
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import inner, kernel
from haptic_env.hand import Hand
from haptic_env.moved import renamed
from observer.maps.capsules import MeanFrames

__getattr__ = renamed(__name__, {"Said": "LinkHistory"})

APART = 3.0  # in units of what is alike: from places further apart nothing is said again
BY_PLACE = (0.0, 0.0)  # the `time` of looks that are alike by place alone
SHORT = 0.01  # share by which looks are alike in time, below which nothing is said again

KEPT = 1024  # looks of a link that said something new; the oldest are forgotten
LITTLE = 0.001  # share of what a link says that is not worth weighing
ALIKE = 0.6  # voxels: what a link says of them from places further apart is news to a map
FEW, MOSTLY = 0.05, 0.5  # share of it that is not worth weighing, and that from which on a map takes all in


class LinkHistory(NamedTuple):
    """What links have said.

    Attributes:
        place: (L, M, 6) m of each look, both ends of the link's bone.
        exponent: (L, M) with which it counts.
        contacts: (M, P) what was felt, each link's in the columns of its patches.
        touches: (L, M) how many of those felt contact.
        looks: (L,) how many there were, the last one at (looks - 1) % M.
        when: (L, M) s, of each look.
        length: (L,) m of the bones.
        first_patch: (L + 1,) the patches of link l are `first_patch[l]` up to `first_patch[l + 1]`.
    """

    place: NDArray[np.float64]
    exponent: NDArray[np.float64]
    contacts: NDArray[np.bool_]
    touches: NDArray[np.int64]
    looks: NDArray[np.int64]
    when: NDArray[np.float64]
    length: NDArray[np.float64]
    first_patch: NDArray[np.int64]

    @classmethod
    def nothing(cls, hand: Hand, kept: int = KEPT) -> Self:
        """Begin before the first look.

        Args:
            hand: with L links.
            kept: M.

        Returns:
            The history.
        """
        links = len(hand.links)
        return cls(
            np.zeros((links, kept, 6)),
            np.zeros((links, kept)),
            np.zeros((kept, len(hand.patches)), dtype=np.bool_),
            np.zeros((links, kept), dtype=np.int64),
            np.zeros(links, dtype=np.int64),
            np.zeros((links, kept)),
            np.array([link.length for link in hand.links]),
            np.searchsorted(hand.patches.link, np.arange(links + 1)).astype(np.int64),
        )


@inner()
def repeated(said, link, place, contacts, touches, alike, now=0.0, lasting=0.0):
    """Tell how much of what a link says it has said before: of each look the share that says the same.

    Args:
        said: the history.
        link: index.
        place: (6,) m, where it is.
        contacts: (P,) what its patches feel.
        touches: how many of those feel contact.
        alike: m, by which places may differ that say the same.
        now: s, when that is.
        lasting: s, how long an error of the pose lasts; 0: looks are alike by place alone.

    Returns:
        The exponent of that, 0 where all is news.
    """
    total, most = 0.0, 2.0 * (APART * alike) ** 2
    for look in range(min(said.looks[link], len(said.contacts))):
        square = 0.0
        for i in range(6):
            square += (said.place[link, look, i] - place[i]) ** 2
        near = np.exp(-0.25 * square / alike**2) if square <= most else 0.0
        if lasting > 0.0:
            near = max(near, np.exp((said.when[link, look] - now) / lasting))
        if near < SHORT:
            continue
        same, either = 1.0, touches + said.touches[link, look]
        if either > 0:
            both = 0
            if touches > 0 and said.touches[link, look] > 0:
                for patch in range(said.first_patch[link], said.first_patch[link + 1]):
                    both += contacts[patch] and said.contacts[look, patch]
            same = both / (either - both)
        total += said.exponent[link, look] * same * near
    return total


@inner()
def ends(length, position, rotation, place):
    """Find both ends of a bone.

    Args:
        length: m.
        position: (3,) m, where it begins.
        rotation: (3, 3), along whose z axis it lies.
        place: (6,) m, filled.
    """
    for i in range(3):
        place[i] = position[i]
        place[3 + i] = position[i] + length * rotation[i, 2]


@kernel()
def note(said, frames, contacts, alike, temper, least, time, news):
    """Tell how much of what each link says is new, and take note of it, so that like looks together have an exponent of
    at most 1.

    Args:
        said: the history, added to.
        frames: of the links, positions (L, 3) m and rotations (L, 3, 3).
        contacts: (P,).
        alike: (L,) m, by which places may differ that say the same.
        temper: exponent of what is all new.
        least: share up to which it is no news at all.
        time: s, when that is, and how long an error of the pose lasts; 0: looks are alike by place alone.
        news: (L,) filled: 1 where all of it is.
    """
    now, lasting = time
    place = np.empty(6)
    for link in range(len(news)):
        first, end = said.first_patch[link], said.first_patch[link + 1]
        ends(said.length[link], frames[0][link], frames[1][link], place)
        touches = 0
        for patch in range(first, end):
            touches += contacts[patch]
        new = 1.0 - repeated(said, link, place, contacts, touches, alike[link], now, lasting)
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
        said.when[link, look] = now
        said.looks[link] += 1


def unmeasured_links(hand: Hand, unmeasured: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Find the links that have nothing to say, as nothing of their skin was measured.

    Args:
        hand: with L links and P patches.
        unmeasured: (P,) patches whose contact was not measured.

    Returns:
        (L,).
    """
    return np.asarray(np.bincount(hand.patches.link, ~unmeasured, len(hand.links)) == 0)


class MapNovelty:
    """Which links have something to say to a map that they have not said from the same place already."""

    def __init__(self, hand: Hand, repeats: float, resolution: float) -> None:
        """Begin with all being news.

        Args:
            hand: of whose links it is.
            repeats: as in `ContactModel`.
            resolution: m, of the map.
        """
        self._hand = hand
        self._share = 1.0 / repeats if repeats else 0.0  # of all that can be said at one place
        self._alike = np.full(len(hand.links), ALIKE * resolution)
        self.reset()

    def reset(self) -> None:
        """Start a trial: all is news."""
        self._said, self._news = LinkHistory.nothing(self._hand), np.ones(len(self._hand.links))

    def branch(self) -> Self:
        """Branch off, so that more can be heard of which this one is not to take note.

        Returns:
            One to which the same is news.
        """
        other = copy.copy(self)
        other._said, other._news = copy.deepcopy(self._said), self._news.copy()
        return other

    def fade(self, share: float) -> None:
        """Forget what was said: it is news again.

        Args:
            share: of it that is left.
        """
        self._said.exponent[:] *= share

    def heard(
        self, stance: MeanFrames, contacts: NDArray[np.bool_], mute: NDArray[np.bool_] | None = None
    ) -> NDArray[np.bool_]:
        """Tell what is news, and take note of it.

        Args:
            stance: of the hand at the mean pose.
            contacts: (P,).
            mute: (L,) links that have nothing to say (`unmeasured_links`); None: all have.

        Returns:
            (L,) whether a map takes in what each link says.
        """
        if mute is not None and mute.all():
            return ~mute
        if self._share:
            body = self._hand.link_bodies
            frames = stance.position[body], stance.rotation[body]
            note(self._said, frames, contacts, self._alike, self._share, FEW, BY_PLACE, self._news)
        news = self._news > MOSTLY
        return news if mute is None else news & ~mute
