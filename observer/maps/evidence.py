"""What the contact model says of a cell, as tables that compiled code reads.

Shapes: N particles, J joints, L links, P patches, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.compiled import kernel
from haptic_env.moved import renamed

__getattr__ = renamed(__name__, {"Reach": "LinkEvidence"})

QUANTUM = 0.05  # log-odds per unit of the int8 maps, which thus reach ±6.35
LIMIT = 127
LEAST = np.log(1e-6)  # of the probability of one patch: nothing is impossible
LOG_ODDS = QUANTUM * np.arange(-128, 128)  # of a map entry v at [v + 128], above those of the prior
BINS = 64  # of the squared distance from a bone, in tables of what a link says of a cell


class Evidence(NamedTuple):
    """The numbers of `observer.maps.contact_model.ContactModel`, for the kernels; lengths in metres.

    Tables (256,) of a map entry v at [v + 128]: `probability` that the cell is occupied, `log_clear` log of the
    probability that it rings no patch, and `log_silent` the same where only what is known to be occupied counts.
    `depth` (LIMIT,): how many SDs above the skin a cell lies at most that loses at least 1, 2, … quanta to a sweep.
    `log_no_alarm`: that there is no false alarm. `solid`: the least map entry that says occupied rather than free.
    """

    hit: float
    false_alarm: float
    give: float
    edge: float
    deep: float
    shell: float
    fall: float
    blur: float
    near: float
    temper: float
    log_no_alarm: float
    solid: int
    probability: NDArray[np.float64]
    log_clear: NDArray[np.float64]
    log_silent: NDArray[np.float64]
    depth: NDArray[np.float64]


class LinkEvidence(NamedTuple):
    """What each link says of the cells about it at one step, given how surely its place is known (L links).

    `place` (L,) m: SD of its place along any one axis, as far as maps allow for it.
    `free` (L, BINS): quanta of log-odds that a cell loses, by its squared distance from the bone in units of `bin`
    (L,) m²; `carved` (L,) m: the distance from which on it loses nothing. `fall` (L,) m: over what distance beyond the
    shell a cell's part in a touch fades; `felt` (L,) m: the distance from which on it has none.
    """

    place: NDArray[np.float64]
    free: NDArray[np.int64]
    bin: NDArray[np.float64]
    carved: NDArray[np.float64]
    fall: NDArray[np.float64]
    felt: NDArray[np.float64]

    def of(self, links: NDArray[np.bool_]) -> LinkEvidence:
        """The same where only `links` (L,) sweep anything away."""
        if links.all():
            return self
        return self._replace(free=np.where(links[:, None], self.free, 0), carved=np.where(links, self.carved, 0.0))


@kernel()
def reach_of(body, evidence, place):
    """The `LinkEvidence` of the links of `body`, the SD of their places being `place` (L,) m.

    If the cell at depth d beneath the skin were occupied, the link could not be there: what speaks for it is only the
    probability Φ(-d / SD) that it is elsewhere. The log of that, in quanta, is looked up from the other side: how deep
    a cell must lie to lose so many (`Evidence.depth`).
    """
    links = len(place)
    free, bin, carved = np.zeros((links, BINS), dtype=np.int64), np.empty(links), np.empty(links)
    fall, felt = np.empty(links), np.empty(links)
    for link in range(links):
        bin[link], carved[link] = (body.radius[link] + 2.0 * evidence.edge) ** 2 / BINS, 0.0
        fall[link] = np.hypot(evidence.fall, evidence.blur * place[link])
        felt[link] = body.radius[link] + evidence.shell + 2.5 * fall[link]
        unsure = np.hypot(place[link], evidence.edge)
        lost = LIMIT
        for b in range(BINS):
            height = np.sqrt((b + 0.5) * bin[link]) - body.radius[link]
            while lost > 0 and height + evidence.give > evidence.depth[lost - 1] * unsure:
                lost -= 1
            if lost == 0:
                break
            free[link, b] = lost
            carved[link] = np.sqrt((b + 1) * bin[link]) * (1.0 - 1e-12)  # rounding leads to no bin beyond the last
    return LinkEvidence(place, free, bin, carved, fall, felt)
