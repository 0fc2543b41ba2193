"""Modes of where a solid lies, what is drawn about them, and the densities of that.

Shapes: M modes, D draws. Lengths in metres.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import kernel, part

LOG_CIRCLE, LOG_TURNS = math.log(2.0 * math.pi), math.log(8.0 * math.pi**2)


class Modes(NamedTuple):
    """Where a solid explains what was felt.

    Attributes:
        units: (M, 9) as of `Variants.draw`.
        spread: (M, 7, 7) covariances of size and place in units and of a turn in rad, with which touches leave them.
        fit: (M,) log likelihood of all that was felt.
    """

    units: Array
    spread: Array
    fit: Array

    def of(self, which: NDArray[np.int64]) -> Modes:
        """Choose some.

        Args:
            which: (K,) of them.

        Returns:
            Those.
        """
        return Modes(*(each[which] for each in self))


class Found(NamedTuple):
    """The posterior of one solid.

    Attributes:
        units: (D, 9) as of `Variants.draw`.
        log_weight: (D,) log of weights, whose sum is the evidence.
        fit: (D,) log likelihood of all that was felt.
        log_evidence: of the solid; no number where no draw explains anything.
        effective: how many draws matter; likewise.
    """

    units: Array
    log_weight: Array
    fit: Array
    log_evidence: float
    effective: float


def shares(fit: Array) -> Array:
    """Say how many draws are made about each mode.

    Args:
        fit: (M,) log likelihood.

    Returns:
        (M,) shares.
    """
    share = np.exp(0.5 * (fit - fit.max()))
    return np.asarray(share / share.sum())


@kernel()
def log_mixture(units, modes, factor, place, log_share, floor, out):
    """Tell how probable draws from a mixture are: about modes, about the places of modes at any turn, and anywhere.

    Args:
        units: (D, 9) as of `Variants.draw`.
        modes: (M, 9).
        factor: (M, k, k) Cholesky's, of the covariance of what is not known, a turn being the last three.
        place: (k - 3,) columns of the others.
        log_share: (M, 2) logs of the shares of the first two, the second less that of turns that may be.
        floor: log of the third's share times its density.
        out: (D,), filled with the logs of densities, of turns by the share of all turns.
    """
    size, places = factor.shape[1], len(place)
    scaled, terms = np.empty(size), np.empty(2 * len(modes) + 1)
    log_det = np.zeros((len(modes), 2))
    for m in range(len(modes)):
        for i in range(size):
            log_det[m, 0] += math.log(factor[m, i, i])
            if i < places:
                log_det[m, 1] = log_det[m, 0]
    for d in range(len(units)):
        most = terms[-1] = floor
        for m in range(len(modes)):
            x, y, z, angle = _turn_between(units[d], modes[m])
            square = at_any_turn = 0.0
            for i in range(size):
                if i < places:
                    off = units[d, place[i]] - modes[m, place[i]]
                else:
                    off = x if i == places else (y if i == places + 1 else z)
                for j in range(i):
                    off -= factor[m, i, j] * scaled[j]
                scaled[i] = off / factor[m, i, i]
                square += scaled[i] ** 2
                if i == places - 1:
                    at_any_turn = square
            # How many turns there are to a rotation vector: most about 0.
            crowded = math.log(2.0 * (1.0 - math.cos(angle)) / angle**2) - LOG_TURNS
            terms[2 * m] = log_share[m, 0] - 0.5 * square - log_det[m, 0] - 0.5 * size * LOG_CIRCLE - crowded
            terms[2 * m + 1] = log_share[m, 1] - 0.5 * at_any_turn - log_det[m, 1] - 0.5 * places * LOG_CIRCLE
            most = max(most, terms[2 * m], terms[2 * m + 1])
        total = 0.0
        for term in terms:
            total += math.exp(term - most)
        out[d] = most + math.log(total)


@part()
def _turn_between(draw, mode):
    """By what turn in the world a draw (9,) differs from a mode (9,): a rotation vector, rad, and its length."""
    a, b, c, d = draw[5], draw[6], draw[7], draw[8]
    x, y, z, w = -mode[5], -mode[6], -mode[7], mode[8]
    u, v, t = d * x + a * w + b * z - c * y, d * y - a * z + b * w + c * x, d * z + a * y - b * x + c * w
    real = d * w - a * x - b * y - c * z
    sine = max(math.sqrt(u * u + v * v + t * t), 1e-12)
    angle = 2.0 * math.atan2(sine, abs(real))
    by = angle / sine if real >= 0.0 else -angle / sine
    return by * u, by * v, by * t, max(angle, 1e-6)
