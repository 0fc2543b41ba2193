"""What a subject holds for evidence at the time of an answer, from the courses of an ideal observer.

Shapes: as in `Courses`: M cells, S sigmas, R repeats, T times, C names; K questions, each a cell and a time.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_lab.people.courses import Courses
from observer.shape.fading import faded

LEAST = -700.0  # nats: what is less probable counts as impossible, and takes no part in sums as infinity would
SAME = 1e-9  # nats, by which names may differ that are equally probable beforehand
LATE = 1e-6  # s, by which a question may come after the last time of the courses


def held(courses: Courses, memory_seconds: float = math.inf) -> Array:
    """Let what was found out fade.

    Args:
        courses: of an ideal observer.
        memory_seconds: s, the time constant with which evidence is forgotten; inf: never.

    Returns:
        (M, S, R, T, C) nats but for a constant of each time, at `times`; the first is the prior.
    """
    if math.isinf(memory_seconds):
        believed = courses.log_posterior
    else:  # cell by cell, as sweeps that were put together may have begun otherwise
        told = zip(courses.log_posterior, _priors(courses), strict=True)
        believed = np.stack([faded(each, courses.seconds, memory_seconds, prior) for each, prior in told])
    believed = np.maximum(believed, LEAST)  # NaN stays
    if courses.seconds[0] == 0.0:
        return believed
    return np.concatenate((np.zeros_like(believed[..., :1, :]), believed), axis=3)


def _priors(courses: Courses) -> list[Array | None]:
    """(C,) nats of each cell, which do not fade; None: all names are equally probable, or it is not known."""
    found: list[Array | None] = []
    for cell in courses.log_posterior[..., 0, :]:
        told = cell.reshape(-1, cell.shape[-1])
        told = told[~np.isnan(told).any(axis=1)]
        possible = np.isfinite(told[0]) if len(told) else np.zeros(0, dtype=bool)
        plain = courses.seconds[0] != 0.0 or not possible.any() or np.ptp(told[0][possible]) < SAME
        found.append(None if plain else np.where(possible, told[0], 0.0))
    return found


def times(courses: Courses) -> Array:
    """Say when `held` tells of.

    Args:
        courses: of an ideal observer.

    Returns:
        (T,) s, the first 0.
    """
    return courses.seconds if courses.seconds[0] == 0.0 else np.concatenate(([0.0], courses.seconds))


def asked(evidence: Array, at: Array, cells: NDArray[np.intp], seconds: Array) -> Array:
    """Take the evidence at the times of questions, between two times of the courses in proportion.

    Args:
        evidence: (M, S, R, T, C) as `held` has it.
        at: (T,) s, its times.
        cells: (K,) of the questions.
        seconds: (K,) s, no later than the last time.

    Returns:
        (K, S, R, C) nats; NaN where a repeat is missing or was not that long.
    """
    after = np.clip(np.searchsorted(at, seconds - LATE), 1, len(at) - 1)
    share = np.clip((seconds - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)[:, None, None, None]
    before, later = evidence[cells, :, :, after - 1], evidence[cells, :, :, after]
    return np.where(share < 1.0, (1.0 - share) * before + share * later, later)


def check_times(courses: Courses, seconds: ArrayLike) -> Array:
    """Check the times of questions.

    Args:
        courses: that are asked.
        seconds: (K,) s.

    Returns:
        The times.

    Raises:
        ValueError: for one that is later than the courses reach.
    """
    result = validate.numbers("seconds", seconds, 1)
    late = np.flatnonzero((result < 0.0) | (result > courses.seconds[-1] + LATE))
    if late.size:
        where, last = int(late[0]), float(courses.seconds[-1])
        raise ValueError(f"seconds must be in [0, {last:g}] s, as long as the courses are, got {result[where]:g}")
    return result


def between(levels: Array, wanted: ArrayLike) -> Array:
    """Weigh the sigmas of courses so that they stand for others between them, on a logarithmic scale.

    Args:
        levels: (S,) degrees, ascending.
        wanted: (n,) degrees, within them.

    Returns:
        (n, S) weights, of which two of a row at most are not 0.

    Raises:
        ValueError: for a sigma beyond those of the courses.
    """
    told = validate.numbers("sigma", wanted, 1)
    beyond = told[(told < levels[0] * (1.0 - 1e-9)) | (told > levels[-1] * (1.0 + 1e-9))]
    if beyond.size:
        raise ValueError(
            f"sigma must be in [{levels[0]:g}, {levels[-1]:g}] degrees, where there are courses, got {beyond[0]:g}"
        )
    if len(levels) == 1:
        return np.ones((len(told), 1))
    at, rows = np.log(levels), np.arange(len(told))
    place = np.clip(np.log(told), at[0], at[-1])
    after = np.clip(np.searchsorted(at, place), 1, len(at) - 1)
    share = (place - at[after - 1]) / (at[after] - at[after - 1])
    weights = np.zeros((len(told), len(levels)))
    weights[rows, after - 1], weights[rows, after] = 1.0 - share, share
    return weights
