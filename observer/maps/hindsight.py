"""The map in hindsight: what all touches and sweeps of a trial so far say together.

Shapes: J joints, P patches, L links, (X, Y, Z) voxels, V = X·Y·Z, E touches, C cells that they may be due to.

While a trial lasts, a touch shares its evidence among its suspects by what the map says of them then. A finger that
sweeps one of them later takes from it what it had been given, but the others do not get it. Here every touch is shared
again and again given all sweeps and all other touches, until nothing moves: belief propagation on the noisy-OR network
(Murphy, Weiss & Jordan 1999, UAI; expectation propagation in Minka 2001, UAI, is the same for binary cells).
"""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from haptic_env.grid import Grid
from observer.kinematics import Tree
from observer.maps import capsules
from observer.maps.capsules import Body, BodyFrames, MapInput, any_of, ringing
from observer.maps.cells import spread
from observer.maps.contact_model import QUANTUM, ContactModel, cause_evidence, reach_of
from observer.maps.forgetting import Fade
from observer.maps.free_space import room, sweep
from observer.maps.matching_geometry import near_skin, touched_room
from observer.maps.occupancy import ParticleMaps

WEIGHT = 3.0  # of a touch, times its own: shared out with all that is known it leaves fewer cells in doubt
EDGE = 1.7  # of the skin, times its own: sweeps count in full here, so that what they exclude must be surer
NO_FLOOR = -(2**40)  # sweeps count in full
AWAY = 10.0  # m before a grid lies what is not to meet it
BATCH = 25  # moments that are gathered together: a call costs little of them, and whoever asks waits for no more
ROUNDS = 8  # by then no probability of a trial of 30 s moves by more than 0.03


class Moment(NamedTuple):
    """One step of a trial, or several, in arrays with T in front.

    Attributes:
        position: (B, 3) m, of the hand's bodies at the smoothed pose.
        rotation: (B, 3, 3).
        place: (L,) m, SD of the place of each link.
        contacts: (P,).
        touch: (P,) weight of each patch's touch.
        heard: (L,) the links that have something to say.
    """

    position: Array
    rotation: Array
    place: Array
    contacts: NDArray[np.bool_]
    touch: Array
    heard: NDArray[np.bool_]


class Hindsight:
    """The map of all that was noted, at any moment.

    What sweeps and touches say is gathered once, as the trial goes on; sharing the touches among their suspects is what
    begins anew whenever the map is asked for.
    """

    def __init__(self, tree: Tree, grid: Grid, body: Body, model: ContactModel) -> None:
        """Begin with nothing.

        Args:
            tree: the hand's kinematics.
            grid: of the map.
            body: the hand's capsules.
            model: of touches and sweeps.
        """
        evidence = model.evidence(grid.resolution)
        self._where = tree, body, capsules.lattice_of(grid), evidence._replace(edge=EDGE * evidence.edge)
        self._shape, self._prior = grid.shape, logit(model.prior)
        cells = int(np.prod(grid.shape))
        self._swept, self._seen = np.zeros(cells, dtype=np.int64), np.zeros(cells, dtype=bool)
        self._touches: list[tuple[Array, ...]] = []  # what `share` asks of them, in parts
        self._fresh: list[Moment] = []  # of which nothing was gathered yet
        self.empty = True

    def note(self, moment: Moment) -> None:
        """Take note of a step.

        Args:
            moment: what it has to say.
        """
        self._fresh.append(moment)
        self.empty = False
        if len(self._fresh) == BATCH:
            self._gather()

    def fade(self, fade: Fade) -> None:
        """Forget some of what was noted.

        Args:
            fade: what is left.
        """
        self._gather()
        self._swept = fade.of(self._swept)
        if len(self._touches) > BATCH:
            self.join()
        self._touches = [(number, fade.share * weight, *of) for number, weight, *of in self._touches]

    def branch(self) -> Self:
        """Branch off, so that more can be noted which this one is not to know.

        Returns:
            One that knows the same.
        """
        self._gather()
        self.join()
        other = copy.copy(self)
        other._swept, other._seen = self._swept.copy(), self._seen.copy()
        other._touches, other._fresh = self._touches.copy(), []
        return other

    def occupancy(self) -> Array:
        """Share all touches among their suspects.

        Returns:
            (X, Y, Z) probability that each voxel is occupied given all that was noted, 0.5 where the hand never came
            near.
        """
        self._gather()
        log_odds = self._prior + QUANTUM * self._swept
        evidence = self._where[-1]
        if self._touches:
            self.join()
            share(*self._touches[0], 1.0 - evidence.false_alarm, ROUNDS, log_odds)
        told = np.zeros(len(log_odds), dtype=np.int8)
        spread(np.flatnonzero(self._seen), self._shape, told)
        return np.where(told, expit(log_odds), 0.5).reshape(self._shape)

    def join(self) -> None:
        """Put what was gathered of the touches into one part; to whoever asks it is the same."""
        self._touches = _joined(self._touches)

    def _gather(self) -> None:
        """Gather what the fresh moments say."""
        if not self._fresh:
            return
        tree, body, lattice, _ = self._where
        trial = Moment(*(np.stack(each) for each in zip(*self._fresh, strict=True)))
        step, link = np.nonzero(~trial.heard)
        trial.position[step, tree.link_body[link]] = lattice.origin - AWAY
        trial.contacts[:] &= trial.heard[:, body.patch_link]
        self._touches.append(look_back(self._where, trial, self._swept, self._seen))
        self._fresh = []


def _joined(parts: list[tuple[Array, ...]]) -> list[tuple[Array, ...]]:
    """What touches ask of `share`, in one part."""
    return [tuple(np.concatenate(each) for each in zip(*parts, strict=True))] if len(parts) > 1 else parts


def occupancy(moments: Iterable[Moment], tree: Tree, grid: Grid, body: Body, model: ContactModel) -> Array:
    """Make the map of a trial that is over.

    Args:
        moments: all steps of it.
        tree: the hand's kinematics.
        grid: of the map.
        body: the hand's capsules.
        model: of touches and sweeps.

    Returns:
        (X, Y, Z) probability that each voxel is occupied given all of them.
    """
    hindsight = Hindsight(tree, grid, body, model)
    for moment in moments:
        hindsight.note(moment)
    return hindsight.occupancy()


@kernel()
def look_back(where, trial, swept, seen):
    """Tell what T moments have to say.

    Args:
        where: tree and body of the hand, lattice of the grid, evidence of the contact model.
        trial: the `Moment` of all of them.
        swept: (V,) is filled with the quanta of log-odds that sweeps take.
        seen: (V,) is set where the hand came near.

    Returns:
        What `share` asks of the touches, step by step: `suspects` and `weight` (E,), `cell` and `hits` (C,).
    """
    tree, body, lattice, evidence = where
    slot, stale = np.empty(len(swept), dtype=np.int32), np.empty(len(swept), dtype=np.bool_)
    for each in range(len(slot)):
        slot[each] = -1
    nobody = np.empty((0, 1), dtype=np.int8)  # no particle, no cell has a slot
    maps = ParticleMaps(lattice.shape, swept, slot, nobody, stale, stale, seen, stale)
    felt_patches = 0
    for step in range(len(trial.contacts)):
        for patch in range(trial.contacts.shape[1]):
            felt_patches += trial.contacts[step, patch]
    number, weight = np.empty(felt_patches, dtype=np.int64), np.empty(felt_patches)
    cell, hits = np.empty(64 * felt_patches, dtype=np.int64), np.empty(64 * felt_patches)
    events = count = 0
    for step in range(len(trial.contacts)):
        reach, contacts = reach_of(body, evidence, trial.place[step]), trial.contacts[step]
        felt = MapInput(tree, body, lattice, evidence, reach, contacts, trial.touch[step], trial.heard[step])
        frames = BodyFrames(trial.position[step], trial.rotation[step])
        rings, found = ringing(body, contacts), room(felt, 0.0)
        if any_of(contacts):
            near = touched_room(felt, rings, 0.0)
            cells = near_skin(felt, frames, rings, 0.0, found, near)
            if count + cells > len(cell):
                more = 2 * len(cell) + cells
                old_cell, old_hits = cell, hits
                cell, hits = np.empty(more, dtype=np.int64), np.empty(more)
                for c in range(count):
                    cell[c], hits[c] = old_cell[c], old_hits[c]
            for patch in range(len(contacts)):
                if not contacts[patch]:
                    continue
                fall = reach.fall[body.patch_link[patch]]
                number[events] = 0
                for c in range(cells):
                    if near.patch[c] == patch:
                        beyond = max(near.height[c] - evidence.shell, 0.0) / fall
                        cell[count], hits[count] = near.cell[c], evidence.hit * np.exp(-0.5 * beyond**2)
                        seen[near.cell[c]] = True
                        number[events] += 1
                        count += 1
                weight[events] = WEIGHT * felt.touch[patch]
                events += 1
        sweep(felt, frames, rings, maps, NO_FLOOR, found)
    return number, weight, cell[:count], hits[:count]


@kernel()
def share(suspects, weight, cell, hits, no_alarm, rounds, log_odds):
    """Add what the touches say: in each round every one takes back what it had said, and says what follows from what is
    then known.

    Args:
        suspects: (E,) of how many cells each touch may be.
        weight: (E,).
        cell: (C,) index of those, one touch after the other.
        hits: (C,) probability that each rings the patch if it is occupied.
        no_alarm: probability that a patch does not ring for nothing.
        rounds: how many.
        log_odds: (V,), added to.
    """
    said, clear = np.empty(len(cell)), np.empty(len(cell))
    for c in range(len(cell)):
        said[c] = 0.0
    for _ in range(rounds):
        end = 0
        for e in range(len(suspects)):
            begin, end = end, end + suspects[e]
            silent = no_alarm
            for c in range(begin, end):
                log_odds[cell[c]] -= said[c]
                clear[c] = 1.0 - hits[c] / (1.0 + np.exp(-log_odds[cell[c]]))
                silent *= clear[c]
            for c in range(begin, end):
                said[c] = cause_evidence(hits[c], clear[c], silent, weight[e], 0.0)
                log_odds[cell[c]] += said[c]
