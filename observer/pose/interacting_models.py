"""One turn of many interacting multiple model filters, compiled.

Shapes: C directions, M levels, S = 3 + T numbers of a direction's state: angle, velocity, acceleration, and the angle
at each of the last T steps. All work in place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from observer.gaussian import add

PRESENT = 3  # numbers of a direction's state now
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
def turn(level, means, covariances, model, felt, variance, log_density):
    """Let the levels change, move on by one step, and take in what was felt (Blom & Bar-Shalom 1988).

    Args:
        level: (C, M) probability of each level, changed.
        means: (C, M, S) of the state at each level, changed.
        covariances: (C, M, S, S), changed.
        model: the `JumpMarkovModel`.
        felt: (C,) rad.
        variance: rad², of its noise.
        log_density: (C,), filled with that of what was felt, given what was before.
    """
    switching, transition, noise = model
    directions, levels, size = means.shape
    mean = np.empty((levels, size))
    covariance = np.empty((levels, size, size))
    after, share = np.empty(levels), np.empty(levels)
    log_level = np.empty(levels)
    for c in range(directions):
        for m in range(levels):
            after[m] = 0.0
            for n in range(levels):
                after[m] += level[c, n] * switching[n, m]
            for n in range(levels):
                share[n] = level[c, n] * switching[n, m] / after[m]
            _mix(share, means[c], covariances[c], mean[m], covariance[m])
        highest = -np.inf
        for m in range(levels):
            _move(transition, noise[m], mean[m], covariance[m], means[c, m], covariances[c, m])
            log_level[m] = np.log(after[m]) + _condition(means[c, m], covariances[c, m], felt[c], variance)
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


@kernel()
def _mix(share, means, covariances, mean, covariance):
    """Fill `mean` (S,) and `covariance` (S, S) with those of the mixture of levels by `share` (M,)."""
    size = len(mean)
    apart = np.empty(size)
    for i in range(size):
        mean[i] = 0.0
        for j in range(size):
            covariance[i, j] = 0.0
    for n in range(len(share)):
        if share[n] > 0.0:
            add(share[n], means[n], mean)
    for n in range(len(share)):
        if share[n] > 0.0:
            for i in range(size):
                apart[i] = means[n, i] - mean[i]
            for i in range(size):
                row = covariance[i]
                add(share[n], covariances[n, i], row)
                add(share[n] * apart[i], apart, row)


@kernel()
def _move(transition, noise, mean, covariance, moved, spread):
    """Fill `moved` (S,) and `spread` (S, S) with what a step makes of one: angles become those of a step ago."""
    size = len(mean)
    with_now = np.zeros((PRESENT, size))  # of what is now, moved, with what was
    for i in range(PRESENT):
        moved[i] = 0.0
        for k in range(PRESENT):
            moved[i] += transition[i, k] * mean[k]
            add(transition[i, k], covariance[k], with_now[i])
    for i in range(PRESENT):
        for j in range(PRESENT):
            spread[i, j] = noise[i, j]
            for k in range(PRESENT):
                spread[i, j] += with_now[i, k] * transition[j, k]
    for i in range(PRESENT, size):
        before = 0 if i == PRESENT else i - 1
        moved[i] = mean[before]
        row, old = spread[i], covariance[before]
        row[PRESENT] = old[0]
        for j in range(PRESENT + 1, size):
            row[j] = old[j - 1]
        for k in range(PRESENT):
            row[k] = with_now[k, before]
            spread[k, i] = with_now[k, before]


@kernel()
def _condition(mean, covariance, felt, variance):
    """Take in the angle `felt` rad; returns its log density."""
    total = covariance[0, 0] + variance
    residual = felt - mean[0]
    with_felt = np.empty(len(mean))
    for i in range(len(mean)):
        with_felt[i] = covariance[0, i]
    add(residual / total, with_felt, mean)
    for i in range(len(mean)):
        add(-with_felt[i] / total, with_felt, covariance[i])
    return -0.5 * (residual**2 / total + np.log(2.0 * np.pi * total))
