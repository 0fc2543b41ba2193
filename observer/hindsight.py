"""The map in hindsight: what all touches and sweeps of a trial say together, once it is over.

Shapes: J joints, P patches, L links, (X, Y, Z) voxels, V = X·Y·Z, E touches, C cells that they may be due to.

While a trial lasts, a touch shares its evidence among its suspects by what the map says of them then. A finger that
sweeps one of them later takes from it what it had been given, but the others do not get it. Here every touch is shared
again and again given all sweeps and all other touches, until nothing moves: belief propagation on the noisy-OR network
(Murphy, Weiss & Jordan 1999, UAI; expectation propagation in Minka 2001, UAI, is the same for binary cells).
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from haptic_env.grid import Grid
from observer import capsules, marginal_kernels
from observer.capsules import Body, Evidence
from observer.contact_model import ContactModel
from observer.kinematics import Tree
from observer.marginal_kernels import Suspects

Array = NDArray[np.float64]
WEIGHT = 3.0  # of a touch, times its own: shared out with all that is known it leaves fewer cells in doubt
EDGE = 1.7  # of the skin, times its own: sweeps count in full here, so that what they exclude must be surer
NO_FLOOR = -(2**40)  # sweeps count in full
DOUBT = 1e-9  # probability that a touch with a single suspect, and no false alarms, had another cause
ROUNDS = 8  # by then no probability of a trial of 30 s moves by more than 0.03


class Moment(NamedTuple):
    """One step of a trial: the hand's `tree`, its smoothed `pose` (J,) rad, the SD of each link's `place` (L,) m,
    `contacts` (P,), and the weight of each patch's `touch` (P,)."""

    tree: Tree
    pose: Array
    place: Array
    contacts: NDArray[np.bool_]
    touch: Array


class Touches(NamedTuple):
    """Of the touches of one step after another, the number of `suspects` and the `weight` (E,) of each, and the `cell`
    (C,) of every suspect with the probability (C,) that it, if occupied, `hits`."""

    suspects: list[NDArray[np.int64]]
    weight: list[Array]
    cell: list[NDArray[np.int64]]
    hits: list[Array]

    def add(self, found: Suspects, evidence: Evidence) -> None:
        """Take in what is `found` at one step."""
        count = np.diff(found.begin)
        beyond = np.maximum(found.height - evidence.shell, 0.0) / np.repeat(found.fall, count)
        self.suspects.append(count)
        self.weight.append(WEIGHT * found.weight)
        self.cell.append(found.cell)
        self.hits.append(evidence.hit * np.exp(-0.5 * beyond**2))


def occupancy(moments: list[Moment], grid: Grid, body: Body, model: ContactModel) -> Array:
    """(X, Y, Z) probability that each voxel is occupied given all `moments`, 0.5 where the hand never came near."""
    evidence = model.evidence(grid.resolution)
    evidence = evidence._replace(edge=EDGE * evidence.edge)
    lattice = capsules.lattice_of(grid)
    cells = int(np.prod(grid.shape))
    swept, shared = np.zeros(cells, dtype=np.int64), np.full(cells, -1, dtype=np.int32)
    seen, stale = np.zeros((2, cells), dtype=bool)
    touches = Touches([], [], [], [])
    for tree, pose, place, contacts, touch in moments:
        reach = capsules.reach_of(body, evidence, place)
        if contacts.any():
            found = marginal_kernels.suspects(tree, body, lattice, evidence, reach, contacts, touch, 0.0, pose)
            touches.add(found, evidence)
            seen[found.cell] = True
        marginal_kernels.sweep_free(
            tree, body, lattice, evidence, reach, contacts, True, pose, swept, NO_FLOOR, shared, seen, stale
        )
    log_odds = logit(model.prior) + capsules.QUANTUM * swept
    if touches.cell:
        suspects, weight, cell, hits = (np.concatenate(part) for part in touches)
        share(suspects, weight, cell, hits, 1.0 - evidence.false_alarm, ROUNDS, log_odds)
    return np.where(seen, expit(log_odds), 0.5).reshape(grid.shape)


@numba.njit(cache=True, error_model="numpy")
def share(suspects, weight, cell, hits, no_alarm, rounds, log_odds):
    """Add to `log_odds` (V,) what the touches say: E of them, of so many `suspects` and of a `weight` each; `cell` (C,)
    and `hits` (C,) are those of one touch after another. `no_alarm`: probability that a patch does not ring for
    nothing.

    In each of the `rounds` every touch takes back what it had said, and says what follows from what is then known.
    """
    said = np.zeros(len(cell))
    clear = np.empty(len(cell))
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
                # As in `marginal_kernels`: hits · others / (1 - others).
                said[c] = weight[e] * np.log1p(hits[c] * silent / max(clear[c] - silent, DOUBT))
                log_odds[cell[c]] += said[c]
