"""All that links have felt so far, to be held against hypotheses again: one record for each link and look.

Shapes: N records, T looks, H hypotheses, L links, P patches. Lengths in metres.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from observer.shape.contact_likelihood import CLEAR, LEAST, TouchModel, WeighedTouch, link_likelihood
from observer.shape.distance_fields import Solids
from observer.shape.link_gaps import scratch_of
from observer.shape.registration import Touched
from observer.shape.skin import Skin, touches_of

FIRST_ROOM = 1024  # records; room is doubled where it runs out
MOST_PATCHES, MOST_BALLS = 64, 96  # of what was felt, in the search for places where a solid would explain it


class Look(NamedTuple):
    """What was felt at one step.

    Attributes:
        position: (L, 3) m, of each link's frame.
        rotation: (L, 3, 3).
        contacts: (P,) 1, 0 or `UNKNOWN`, of 8 bits.
        exponent: (L,) with which counts what each link says; 0: it says nothing.
        model: of touch, with a tolerance for each link.
    """

    position: Array
    rotation: Array
    contacts: NDArray[np.int8]
    exponent: Array
    model: TouchModel


class Records(NamedTuple):
    """What links felt.

    Attributes:
        link: (N,) index of each.
        look: (N,) row of `contacts`.
        position: (N, 3) m, of the link's frame.
        rotation: (N, 3, 3).
        touches: (N,) how many of its patches felt contact.
        exponent: (N,) with which counts what it says.
        tolerance: (N,) m.
        contacts: (T, P), as a look's.
    """

    link: NDArray[np.int64]
    look: NDArray[np.int64]
    position: Array
    rotation: Array
    touches: NDArray[np.int64]
    exponent: Array
    tolerance: Array
    contacts: NDArray[np.int8]


class Felt:
    """The records of a trial."""

    def __init__(self, skin: Skin, middle: Array, reach: Array) -> None:
        """Begin before the first look.

        Args:
            skin: of the hand.
            middle: (K, 3) m, of balls outside which no hypothesis reaches.
            reach: (K,) m, their radii.
        """
        self._middle, self._reach = middle, reach
        self._of_patches = np.argsort(skin.patch, kind="stable")  # points, those of each patch one after the other
        self._points = np.searchsorted(skin.patch[self._of_patches], np.arange(skin.first_patch[-1] + 1))
        self.looks, self._first_of_last, self._count = 0, 0, 0
        self.touched_so_far = 0.0  # patches, each with its exponent
        self._skin = skin
        self._model = TouchModel(0.0, 0.0, 0.0)
        links, room, patches = len(skin.body), FIRST_ROOM, skin.first_patch[-1]
        self._records = Records(
            np.empty(room, dtype=np.int64),
            np.empty(room, dtype=np.int64),
            np.empty((room, 3)),
            np.empty((room, 3, 3)),
            np.empty(room, dtype=np.int64),
            np.empty(room),
            np.empty(room),
            np.empty((room // links + 1, patches), dtype=np.int8),
        )

    def take(self, look: Look) -> None:
        """Take note of what was felt.

        Args:
            look: copied.
        """
        touches = touches_of(self._skin, look.contacts)
        said = np.flatnonzero((look.exponent > 0.0) & ((touches > 0) | self._near(look)))
        upto = self._count + len(said)
        rows = [upto] * (len(self._records) - 1) + [self.looks + 1]
        arrays: tuple[NDArray[Any], ...] = self._records
        self._records = Records(*map(_with_room, arrays, rows))
        records, mine = self._records, slice(self._count, upto)
        records.link[mine], records.look[mine] = said, self.looks
        records.position[mine], records.rotation[mine] = look.position[said], look.rotation[said]
        records.touches[mine] = touches[said]
        self.touched_so_far += float(touches @ look.exponent)
        records.exponent[mine], records.tolerance[mine] = look.exponent[said], np.asarray(look.model.tolerance)[said]
        records.contacts[self.looks] = look.contacts
        self._model, self.looks = look.model, self.looks + 1
        self._first_of_last, self._count = self._count, upto

    def _near(self, look: Look) -> NDArray[np.bool_]:
        """(L,) which links any hypothesis may come near: the others are as they would be without it."""
        ball = look.position + self._skin.middle[:, None] * look.rotation[:, :, 2]
        return self._close(ball, self._skin.ball + CLEAR * look.model.tolerance)

    def log_likelihood(self, solids: Solids, temper: float, least: Array | None = None) -> tuple[Array, int]:
        """Tell how probable all that was felt is.

        No record adds to it, so that those that tell most refuse most hypotheses at once.

        Args:
            solids: H hypotheses.
            temper: exponent.
            least: (H,) what is of no use if it is not exceeded; None: all is.

        Returns:
            (H,), -inf where it is of no use; and how many records were looked at.
        """
        least = np.full(len(solids.scale), -np.inf) if least is None else least
        told = self._records.exponent[: self._count] * (1 + self._records.touches[: self._count])
        return self._held_against(solids, np.argsort(-told, kind="stable"), temper, least)

    def last(self, solids: Solids, temper: float) -> tuple[Array, int]:
        """Tell how probable what was felt last is.

        Args:
            solids: H hypotheses.
            temper: exponent.

        Returns:
            (H,) log likelihood; and how many records were looked at.
        """
        least = np.full(len(solids.scale), -np.inf)
        return self._held_against(solids, np.arange(self._first_of_last, self._count), temper, least)

    def touched(self, temper: float, rng: np.random.Generator) -> tuple[Touched, Touched]:
        """Put all that was felt into the world, as points that touch and balls of flesh that lie outside.

        Args:
            temper: exponent.
            rng: chooses, where there is more than enough.

        Returns:
            At most `MOST_PATCHES` and `MOST_BALLS`, which together count as much as all and draw from afar; and all,
            which say what the likelihood says.
        """
        skin, all_of = self._skin, slice(self._count)
        link, look, position, rotation, touches, exponent, tolerance, contacts = self._records
        link, position, rotation, tolerance = link[all_of], position[all_of], rotation[all_of], tolerance[all_of]
        exponent = temper * exponent[all_of]
        worth = exponent / tolerance**2
        owner = np.repeat(np.arange(len(skin.body)), np.diff(skin.first_patch))
        n, patch = np.nonzero((contacts[look[all_of]] > 0) & (owner == link[:, None]))
        beads = np.diff(skin.first_bead)[link]
        m = np.arange(self._count).repeat(beads)
        bead = np.arange(len(m)) - np.repeat(np.cumsum(beads) - beads, beads) + skin.first_bead[link[m]]
        balls = position[m] + skin.along[bead, None] * rotation[m, :, 2]
        middle = position + skin.middle[link, None] * rotation[:, :, 2]
        press, surprise = self._model.press, self._model.surprise
        every = Touched(
            *self._points_of(n, patch),
            exponent[n],
            tolerance[n],
            balls,
            skin.radius[bead],
            np.concatenate([[0], np.cumsum(beads)]),
            np.concatenate([middle, skin.ball[link, None]], axis=1),
            exponent,
            tolerance,
            np.where(touches[all_of] > 0, tolerance + press, 0.0),
            surprise,
        )
        n, patch, share = _chosen(worth[n], MOST_PATCHES, rng, n, patch)
        near = np.flatnonzero(self._close(balls, skin.radius[bead]))
        near, cost = _chosen(worth[m[near]], MOST_BALLS, rng, near)
        mine, each = tolerance[m[near]], np.zeros(len(near))
        alone, around = np.arange(len(near) + 1), np.zeros((len(near), 4))
        few = Touched(
            *self._points_of(n, patch),
            share * tolerance[n] ** 2,
            tolerance[n],
            balls[near],
            skin.radius[bead[near]],
            alone,
            around,
            cost * mine**2,
            mine,
            each,
            0.0,
        )
        return few, every

    def _points_of(self, record: NDArray[np.int64], patch: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
        """The points (M, 3) m in the world of patches (N,) of records, and where those of each begin (N + 1,)."""
        count = self._points[patch + 1] - self._points[patch]
        begin = np.concatenate([[0], np.cumsum(count)])
        which = self._of_patches[np.arange(begin[-1]) - np.repeat(begin[:-1] - self._points[patch], count)]
        of = np.repeat(record, count)
        points = np.einsum("mij,mj->mi", self._records.rotation[of], self._skin.points[which])
        return points + self._records.position[of], begin

    def _close(self, points: Array, distance: Array) -> NDArray[np.bool_]:
        """(M,) whether points (M, 3) are closer than a distance (M,) m to where any hypothesis reaches."""
        close = np.empty(len(points), dtype=np.bool_)
        _near_any(points, distance, self._middle, self._reach, close)
        return close

    def _held_against(self, solids: Solids, which: NDArray[np.int64], temper: float, least: Array) -> tuple[Array, int]:
        out = np.empty(len(solids.scale))
        model = self._model.press, self._model.surprise, temper
        return out, _replayed(self._skin, solids, self._records, which, model, least, out)


def _chosen(worth: Array, most: int, rng: np.random.Generator, *rows: NDArray[np.int64]) -> tuple[NDArray[Any], ...]:
    """At most so many of the `rows`, those of more worth more probably, and the worth (M,) that each stands for."""
    if len(worth) <= most:
        return *rows, worth
    kept = rng.choice(len(worth), most, replace=False, p=worth / worth.sum())
    return *(row[kept] for row in rows), np.full(most, worth.sum() / most)


def _with_room(array: NDArray[Any], rows: int) -> NDArray[Any]:
    """The array, or one of twice its rows where it has fewer than `rows`."""
    if rows <= len(array):
        return array
    return np.concatenate([array, np.empty((max(len(array), rows - len(array)), *array.shape[1:]), array.dtype)])


@kernel()
def _near_any(points, distance, middle, reach, close):
    """Fill `close` (M,): whether points (M, 3) are closer than a distance (M,) to any of some balls."""
    for m in range(len(points)):
        close[m] = False
        for k in range(len(middle)):
            x, y, z = points[m, 0] - middle[k, 0], points[m, 1] - middle[k, 1], points[m, 2] - middle[k, 2]
            most = distance[m] + reach[k]
            if most > 0.0 and x * x + y * y + z * z < most * most:
                close[m] = True
                break


@kernel(fastmath=True)
def _replayed(skin, solids, records, order, model, least, out):
    """Fill `out` (H,) with the log likelihood of the records, in this `order`; -inf as soon as it is not above `least`
    (H,). The `model` is press, surprise and the exponent.

    Returns:
        How many records were looked at.
    """
    press, surprise, temper = model
    scratch = scratch_of(skin, records.contacts.shape[1])
    looked = 0
    for h in range(len(out)):
        total = 0.0
        for n in order:
            frame = records.position[n], records.rotation[n]
            felt = WeighedTouch(records.contacts[records.look[n]], records.touches[n], records.exponent[n])
            of_link = TouchModel(records.tolerance[n], press, surprise)
            likelihood = link_likelihood(solids, h, skin, records.link[n], frame, felt, of_link, scratch)
            looked += 1
            if likelihood < 1.0:
                total += temper * np.log(max(likelihood, LEAST))
                if total <= least[h]:
                    total = -np.inf
                    break
        out[h] = total
    return looked
