"""One turn of many interacting multiple model filters, compiled.

Shapes: C directions, M levels, S = 3 + T numbers of a direction's state: angle, velocity, acceleration, and the angle
at each of the last T steps. All work in place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part
from observer.gaussian import add
from observer.pose.lagged_moments import PRESENT, LaggedMoments, mix

LEAST = 1e-12  # no level is impossible


class JumpMarkovModel(NamedTuple):
    """How a direction moves in one step: linear at each level, which now and then jumps to another.

    Attributes:
        switching: (M, M) probability of each level after the step, row by row for the level before it.
        transition: (3, 3) what the step makes of angle, velocity and acceleration.
        noise: (M, 3, 3) covariance of what it adds to them at each level.
    """

    switching: Array
    transition: Array
    noise: Array


@kernel()
def turn(level, moments, model, felt, variance, log_density, mixed):
    """Let the levels change, move on by one step, and take in what was felt (Blom & Bar-Shalom 1988).

    Args:
        level: (C, M) probability of each level, changed.
        moments: `LaggedMoments` of the state at each level, C by M, changed.
        model: the `JumpMarkovModel`.
        felt: (C,) rad.
        variance: (C,) rad², of its noise.
        log_density: (C,), filled with that of what was felt, given what was before.
        mixed: `LaggedMoments` of each direction whatever its level, C, filled.
    """
    switching, transition, noise = model
    means, rows, bands = moments
    directions, levels, size = means.shape
    mean, row, band = np.empty((levels, size)), np.empty((levels, PRESENT, size)), np.empty(bands.shape[1:])
    about, now = np.empty((2, size)), np.empty((PRESENT, size))
    after, share = np.empty(levels), np.empty(levels)
    log_level = np.empty(levels)
    for c in range(directions):
        parts = LaggedMoments(means[c], rows[c], bands[c])
        for m in range(levels):
            after[m] = 0.0
            for n in range(levels):
                after[m] += level[c, n] * switching[n, m]
            for n in range(levels):
                share[n] = level[c, n] * switching[n, m] / after[m]
            mix(share, parts, about, LaggedMoments(mean[m], row[m], band[m]))
        highest = -np.inf
        for m in range(levels):
            moved = LaggedMoments(means[c, m], rows[c, m], bands[c, m])
            _move(transition, noise[m], LaggedMoments(mean[m], row[m], band[m]), now, moved)
            log_level[m] = np.log(after[m]) + _condition(moved, felt[c], variance[c], about)
            highest = max(highest, log_level[m])
        total = 0.0
        for m in range(levels):
            level[c, m] = np.exp(log_level[m] - highest)
            total += level[c, m]
        log_density[c] = highest + np.log(total)
        for m in range(levels):
            level[c, m] = max(level[c, m] / total, LEAST)
        total = 0.0
        for m in range(levels):
            total += level[c, m]
        for m in range(levels):
            level[c, m] /= total
        mix(level[c], parts, about, LaggedMoments(mixed.mean[c], mixed.rows[c], mixed.bands[c]))


@inner()
def _move(transition, noise, before, now, moved):
    """Fill `moved` with what a step makes of `before`: angles become those of a step ago. `now` (3, S) is scratch."""
    mean, rows, bands = before
    moved_mean, moved_rows, moved_bands = moved
    size, lag = len(mean), bands.shape[1]
    for i in range(PRESENT):
        a, b, c = transition[i, 0], transition[i, 1], transition[i, 2]
        moved_mean[i] = a * mean[0] + b * mean[1] + c * mean[2]
        _sum_of_three(a, rows[0], b, rows[1], c, rows[2], now[i])  # what is now, moved, with what was
    for i in range(PRESENT):
        for j in range(PRESENT):
            moved_rows[i, j] = noise[i, j]
            for k in range(PRESENT):
                moved_rows[i, j] += now[i, k] * transition[j, k]
    if not lag:
        return
    moved_mean[PRESENT] = mean[0]
    _copy(mean[PRESENT : size - 1], moved_mean[PRESENT + 1 :])
    for i in range(PRESENT):
        moved_rows[i, PRESENT] = now[i, 0]
        _copy(now[i, PRESENT : size - 1], moved_rows[i, PRESENT + 1 :])
    for a in range(len(bands)):
        moved_bands[a, 0] = rows[0, PRESENT - 1 + a] if a else rows[0, 0]
        _copy(bands[a, : lag - 1 - a], moved_bands[a, 1:])


@part()
def _sum_of_three(a, first, b, second, c, third, target):
    """Do target = a · first + b · second + c · third: all (M,)."""
    for i in range(len(target)):
        target[i] = a * first[i] + b * second[i] + c * third[i]


@part()
def _copy(source, target):
    """Copy all of `source`."""
    for i in range(len(source)):
        target[i] = source[i]


@inner()
def _condition(moments, felt, variance, about):
    """Take in the angle `felt` rad; returns its log density. `about` (2, S) is scratch."""
    mean, rows, bands = moments
    with_felt, scaled = about
    total = rows[0, 0] + variance
    residual = felt - mean[0]
    for i in range(len(mean)):
        with_felt[i] = rows[0, i]
        scaled[i] = -with_felt[i] / total
    add(residual / total, with_felt, mean)
    for k in range(PRESENT):
        add(scaled[k], with_felt, rows[k])
    for a in range(len(bands)):
        for k in range(bands.shape[1] - a):
            bands[a, k] += scaled[PRESENT + k] * with_felt[PRESENT + k + a]
    return -0.5 * (residual**2 / total + np.log(2.0 * np.pi * total))
