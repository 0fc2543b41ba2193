"""What a touch and a silence say: the numbers of p(z | q, m), as a user gives them and as tables for compiled code.

Shapes: N particles, J joints, L links, P patches, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit, ndtri_exp

from haptic_env import readable, validate
from haptic_env.compiled import kernel, part
from haptic_env.grid import LARGEST as LARGEST_VOXEL
from haptic_env.grid import SMALLEST as SMALLEST_VOXEL
from haptic_env.moved import renamed

__getattr__ = renamed(__name__, {"Reach": "LinkEvidence"})

QUANTUM = 0.05  # log-odds per unit of the int8 maps, which thus reach ±6.35
LIMIT = 127
LEAST = np.log(1e-6)  # of the probability of one patch: nothing is impossible
LOG_ODDS = QUANTUM * np.arange(-128, 128)  # of a map entry v at [v + 128], above those of the prior
BINS = 64  # of the squared distance from a bone, in tables of what a link says of a cell
SMALLEST = 1e-9  # weight of a sweep by which no cell loses anything
DOUBT = 1e-9  # probability that a touch with a single suspect, and no false alarms, had another cause


class Evidence(NamedTuple):
    """The numbers of `ContactModel`, for the kernels; lengths in metres.

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


@dataclass(frozen=True)
class ContactModel:
    """Sensor model of the patches against an occupancy grid: a noisy-OR over the cells at a patch (Pearl 1988).

    A cell inside a link is free unless the link is elsewhere: its log likelihood ratio is that of a normal
    distribution's tail at its depth less `give` voxels, with an SD of `edge` voxels and that of the link's place.

    Attributes:
        prior: probability that a cell is occupied, of those whose centre the skin came within `near` voxels of and of
            their 26 neighbours; of the others nothing is said.
        near: voxels.
        hit: probability that an occupied cell at the patch makes it ring, below 1.
        false_alarm: probability that a patch rings for none.
        touch: weight of a touch when it begins, as a multiple of its log likelihood ratio.
        sustained: the same of every step that it lasts: a lasting touch mostly repeats itself.
        shell: voxels, how far above the skin the centre of a touched cell may lie; beyond that its part fades.
        fall: voxels, SD with which it fades.
        blur: times the SD of the link's place, which adds to that.
        deep: voxels, how far beneath the skin a touched cell may lie: fingers press in, and voxels are coarse.
        free: weight of a sweep at every step, for errors last.
        give: voxels, from the depth of a cell.
        edge: voxels, SD of the skin's place.
        caution: how much of the SD of a link's place, given all that was felt, a map allows for; 0 holds the pose fixed
            as the paper does, which is right where particles carry the whole of it.
        temper: exponent of p(z | q, m) in matching and weighing, below 1 because successive steps are not independent.
        repeats: how long a map listens to a link that rests or comes back. What it has to say at one place is said
            after 0.7 times so many steps; from then on neither its sweeps nor its touches change anything
            (`observer.novelty`). 0: every step counts.

    Raises:
        ValueError: for a value out of range.
    """

    prior: float = 0.03
    near: float = 0.87
    hit: float = 0.12
    false_alarm: float = 0.03
    touch: float = 1.6
    sustained: float = 0.4
    shell: float = 0.75
    fall: float = 0.3
    blur: float = 0.5
    deep: float = 0.4
    free: float = 0.07
    give: float = 0.3
    edge: float = 0.175
    caution: float = 1.0
    temper: float = 0.3
    repeats: float = 50.0

    __repr__ = readable.line

    def __post_init__(self) -> None:
        for field in fields(self):
            high = 1.0 if field.name in ("prior", "hit", "false_alarm", "temper") else 10.0
            high = 1e6 if field.name == "repeats" else high
            value = validate.number(field.name, getattr(self, field.name), 0.0, high)
            object.__setattr__(self, field.name, value)  # a float whatever was given: kernels are compiled for those
        if self.hit >= 1.0:
            raise ValueError(f"hit must be below 1, got {self.hit}")
        for name in ("prior", "false_alarm"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ValueError(f"{name} must lie strictly between 0 and 1, got {getattr(self, name)}")
        for name in ("fall", "edge"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"{name} must be above 0 voxels, got {getattr(self, name)}")

    def evidence(self, resolution: float) -> Evidence:
        """Make the tables of the same.

        Args:
            resolution: m, edge of a voxel.

        Returns:
            The tables.

        Raises:
            ValueError: for a `resolution` out of range.
        """
        validate.number("resolution", resolution, SMALLEST_VOXEL, LARGEST_VOXEL, unit="m")
        probability = expit(LOG_ODDS + logit(self.prior))
        return Evidence(
            hit=self.hit,
            false_alarm=self.false_alarm,
            give=self.give * resolution,
            edge=self.edge * resolution,
            deep=self.deep * resolution,
            shell=self.shell * resolution,
            fall=self.fall * resolution,
            blur=self.blur,
            near=self.near * resolution,
            temper=self.temper,
            log_no_alarm=float(np.log1p(-self.false_alarm)),
            solid=int(np.searchsorted(probability, 0.5, side="right")) - 128,
            probability=probability,
            log_clear=np.log1p(-self.hit * probability),
            log_silent=np.log1p(-self.hit * np.maximum(0.0, 2.0 * probability - 1.0)),
            depth=ndtri_exp(-QUANTUM * (np.arange(1, LIMIT + 1) - 0.5) / max(self.free, SMALLEST)),
        )


class LinkEvidence(NamedTuple):
    """What each link says of the cells about it at one step, given how surely its place is known.

    Attributes:
        place: (L,) m, SD of its place along any one axis, as far as maps allow for it.
        free: (L, BINS) quanta of log-odds that a cell loses, by its squared distance from the bone in units of `bin`.
        bin: (L,) m².
        carved: (L,) m from the bone, from where on a cell loses nothing.
        fall: (L,) m beyond the shell, over which a cell's part in a touch fades.
        felt: (L,) m from the bone, from where on it has none; below 0: nothing of the link's skin was measured, so that
            nothing about it is seen.
    """

    place: NDArray[np.float64]
    free: NDArray[np.int64]
    bin: NDArray[np.float64]
    carved: NDArray[np.float64]
    fall: NDArray[np.float64]
    felt: NDArray[np.float64]

    def of(self, links: NDArray[np.bool_]) -> LinkEvidence:
        """Let only some links sweep anything away.

        Args:
            links: (L,) which.

        Returns:
            The same but for that.
        """
        if links.all():
            return self
        return self._replace(free=np.where(links[:, None], self.free, 0), carved=np.where(links, self.carved, 0.0))

    def without(self, links: NDArray[np.bool_]) -> LinkEvidence:
        """Let some links say nothing at all, not even that what is near them was seen.

        Args:
            links: (L,) which.

        Returns:
            The same but for that.
        """
        return self._replace(felt=np.where(links, -1.0, self.felt))


@kernel()
def reach_of(body, evidence, place):
    """Tell what links say of the cells about them.

    If the cell at depth d beneath the skin were occupied, the link could not be there: what speaks for it is only the
    probability Φ(-d / SD) that it is elsewhere. The log of that, in quanta, is looked up from the other side: how deep
    a cell must lie to lose so many (`Evidence.depth`).

    Args:
        body: the hand (`observer.maps.capsules.Body`).
        evidence: the contact model.
        place: (L,) m, SD of the place of each link.

    Returns:
        The `LinkEvidence`.
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


@part()
def cause_evidence(hits, clear, silent, weight, least):
    """Tell what a touch says of one cell that it may be due to, by a noisy-OR (Pearl 1988), given what is known of the
    others.

    At least one of the suspects is occupied, so that a single one gets all of the evidence, and one of many next to
    none. The ratio of likelihoods, were the cell occupied rather than free, is 1 + hits · others / (1 - others), and
    others = silent / clear.

    Args:
        hits: probability that the cell rings the patch if it is occupied.
        clear: that it does not, whatever it is.
        silent: that nothing does.
        weight: of the touch.
        least: of what counts.

    Returns:
        `weight` times the log of the ratio; 0 where that is surely below `least`.
    """
    gain, rest = hits * silent, max(clear - silent, DOUBT)
    return weight * np.log1p(gain / rest) if weight * gain >= least * rest else 0.0
