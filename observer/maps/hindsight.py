"""The map in hindsight: what all touches and sweeps of a trial say together, once it is over.

Shapes: J joints, P patches, L links, (X, Y, Z) voxels, V = X·Y·Z, E touches, C cells that they may be due to.

While a trial lasts, a touch shares its evidence among its suspects by what the map says of them then. A finger that
sweeps one of them later takes from it what it had been given, but the others do not get it. Here every touch is shared
again and again given all sweeps and all other touches, until nothing moves: belief propagation on the noisy-OR network
(Murphy, Weiss & Jordan 1999, UAI; expectation propagation in Minka 2001, UAI, is the same for binary cells).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from haptic_env.grid import Grid
from observer.maps import capsules
from observer.maps.capsules import Body, ringing, room
from observer.maps.cells import any_of, spread
from observer.maps.contact_model import ContactModel
from observer.maps.evidence import QUANTUM, reach_of
from observer.maps.free_space import sweep
from observer.maps.noisy_or import evidence as evidence_of
from observer.maps.suspects import gather, touched_links

WEIGHT = 3.0  # of a touch, times its own: shared out with all that is known it leaves fewer cells in doubt
EDGE = 1.7  # of the skin, times its own: sweeps count in full here, so that what they exclude must be surer
NO_FLOOR = -(2**40)  # sweeps count in full
AWAY = 10.0  # m before a grid lies what is not to meet it
ROUNDS = 8  # by then no probability of a trial of 30 s moves by more than 0.03


class Moment(NamedTuple):
    """One step of a trial: the frames of the hand's bodies at the smoothed pose, `position` (B, 3) m and `rotation`
    (B, 3, 3), the SD of each link's `place` (L,) m, `contacts` (P,), and the weight of each patch's `touch` (P,); only
    of the links that were `heard` (L,)."""

    position: Array
    rotation: Array
    place: Array
    contacts: NDArray[np.bool_]
    touch: Array
    heard: NDArray[np.bool_]


def occupancy(
    moments: list[Moment], link_body: NDArray[np.int64], grid: Grid, body: Body, model: ContactModel
) -> Array:
    """(X, Y, Z) probability that each voxel is occupied given all `moments`, 0.5 where the hand never came near;
    `link_body` (L,) as in `Tree`."""
    evidence = model.evidence(grid.resolution)
    evidence = evidence._replace(edge=EDGE * evidence.edge)
    cells = int(np.prod(grid.shape))
    swept, seen = np.zeros(cells, dtype=np.int64), np.zeros(cells, dtype=bool)
    position, rotation, place, contacts, touch, heard = (np.stack(each) for each in zip(*moments, strict=True))
    lattice = capsules.lattice_of(grid)
    step, link = np.nonzero(~heard)
    position[step, link_body[link]] = lattice.origin - AWAY
    contacts &= heard[:, body.patch_link]
    suspects, weight, cell, hits = look_back(
        link_body, body, lattice, evidence, position, rotation, place, contacts, touch, swept, seen
    )
    log_odds = logit(model.prior) + QUANTUM * swept
    share(suspects, weight, cell, hits, 1.0 - evidence.false_alarm, ROUNDS, log_odds)
    told = np.zeros(cells, dtype=np.int8)
    spread(np.flatnonzero(seen), grid.shape, told)
    return np.where(told, expit(log_odds), 0.5).reshape(grid.shape)


@kernel()
def look_back(link_body, body, lattice, evidence, position, rotation, place, contacts, touch, swept, seen):
    """What T moments have to say, as arrays with T in front: fills `swept` (V,) with the quanta of log-odds that sweeps
    take, and `seen` (V,) with where the hand came near.

    Returns what `share` asks of the touches, step by step: `suspects` and `weight` (E,), `cell` and `hits` (C,).
    """
    slot, stale = np.empty(len(swept), dtype=np.int32), np.empty(len(swept), dtype=np.bool_)
    for each in range(len(slot)):
        slot[each] = -1
    nowhere = np.empty(0, dtype=np.int64)  # no cell has a slot
    along, square = np.empty(lattice.shape[2]), np.empty(lattice.shape[2])
    felt = 0
    for step in range(len(contacts)):
        for patch in range(contacts.shape[1]):
            felt += contacts[step, patch]
    number, weight = np.empty(felt, dtype=np.int64), np.empty(felt)
    cell, hits = np.empty(64 * felt, dtype=np.int64), np.empty(64 * felt)
    events = count = 0
    for step in range(len(contacts)):
        reach, rings = reach_of(body, evidence, place[step]), ringing(body, contacts[step])
        touched = touched_links(body, contacts[step])
        if any_of(touched):
            most = room(body, lattice, reach.felt, touched)
            cells, owner, height = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64), np.empty(most)
            found = gather(
                link_body,
                body,
                lattice,
                evidence,
                reach.felt,
                contacts[step],
                touched,
                rings,
                0.0,
                position[step],
                rotation[step],
                cells,
                owner,
                height,
            )
            if count + found > len(cell):
                more = 2 * len(cell) + found
                old_cell, old_hits = cell, hits
                cell, hits = np.empty(more, dtype=np.int64), np.empty(more)
                for c in range(count):
                    cell[c], hits[c] = old_cell[c], old_hits[c]
            for patch in range(contacts.shape[1]):
                if not contacts[step, patch]:
                    continue
                fall = reach.fall[body.patch_link[patch]]
                number[events] = 0
                for c in range(found):
                    if owner[c] == patch:
                        beyond = max(height[c] - evidence.shell, 0.0) / fall
                        cell[count], hits[count] = cells[c], evidence.hit * np.exp(-0.5 * beyond**2)
                        seen[cells[c]] = True
                        number[events] += 1
                        count += 1
                weight[events] = WEIGHT * touch[step, patch]
                events += 1
        sweep(
            link_body,
            body,
            lattice,
            evidence,
            reach,
            contacts[step],
            rings,
            True,
            position[step],
            rotation[step],
            swept,
            NO_FLOOR,
            slot,
            seen,
            stale,
            nowhere,
            nowhere,
            along,
            square,
        )
    return number, weight, cell[:count], hits[:count]


@kernel()
def share(suspects, weight, cell, hits, no_alarm, rounds, log_odds):
    """Add to `log_odds` (V,) what the touches say: E of them, of so many `suspects` and of a `weight` each; `cell` (C,)
    and `hits` (C,) are those of one touch after another. `no_alarm`: probability that a patch does not ring for
    nothing.

    In each of the `rounds` every touch takes back what it had said, and says what follows from what is then known.
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
                said[c] = evidence_of(hits[c], clear[c], silent, weight[e], 0.0)
                log_odds[cell[c]] += said[c]
