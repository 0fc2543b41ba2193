"""One turn of many interacting multiple model filters, compiled, in two halves: what is expected before anything is
felt, and what is left of that once it is (Blom & Bar-Shalom 1988).

Shapes: C directions, in B blocks of W; M levels; S = 3 + T numbers of a direction's state: angle, velocity and
acceleration, and the angle at each of the last T steps. In a block each number has those of its W directions side by
side, and so has the next one after it: what is done to one is done to some hundred by the same few instructions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel
from observer.gaussian import add
from observer.pose.lagged_moments import PRESENT, LaggedMoments
from observer.pose.plain_loops import (
    WIDE,
    add_product,
    add_products,
    any_above_zero,
    copy,
    fill,
    fill_share,
    negative_share,
    repeat,
    set_apart,
    sum_of_three,
    take_each,
)

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
def expect(level, moments, model, log_prior, ahead):
    """Let the levels change, and move on by one step: all that a step does before anything is felt at it.

    Args:
        level: (B, M, W) probability of each level.
        moments: `LaggedMoments` of the state at each level, B by M of W side by side.
        model: the `JumpMarkovModel`.
        log_prior: (B, M, W), filled with the log probability of each level after the step.
        ahead: `LaggedMoments` like `moments`, filled with those after the step.
    """
    switching, transition, noise = model
    means, rows, bands = moments
    levels, numbers = means.shape[1:]
    share, now, about = np.empty((levels, WIDE)), np.empty((PRESENT, numbers)), np.empty((3 + levels, numbers))
    mixed = LaggedMoments(np.empty(numbers), np.empty(rows.shape[2:]), np.empty(bands.shape[2:]))
    for b in range(len(level)):
        parts = LaggedMoments(means[b], rows[b], bands[b])
        for m in range(levels):
            prior = log_prior[b, m]
            fill(0.0, prior)
            for n in range(levels):
                add(switching[n, m], level[b, n], prior)
            for n in range(levels):
                fill_share(switching[n, m], level[b, n], prior, share[n])
            for i in range(WIDE):
                prior[i] = np.log(prior[i])
            _mix(share, parts, about, mixed)
            moved = LaggedMoments(ahead.mean[b, m], ahead.rows[b, m], ahead.bands[b, m])
            _move(transition, noise[m], mixed, now, moved)


@kernel()
def take_in(log_prior, ahead, felt, variance, level, log_density, mixed):
    """Take in what was felt.

    Args:
        log_prior: (B, M, W), as `expect` fills it.
        ahead: `LaggedMoments`, as `expect` fills them; changed to those given what was felt.
        felt: (C,) rad.
        variance: (C,) rad², of its noise.
        level: (B, M, W), filled with the probability of each level, given that.
        log_density: (C,), filled with that of what was felt, given what was before.
        mixed: `LaggedMoments` of each direction whatever its level, C, filled.
    """
    means, rows, bands = ahead
    levels, numbers = means.shape[1:]
    angle, noise, total, residual = np.zeros(WIDE), np.ones(WIDE), np.empty(WIDE), np.empty(WIDE)
    about = np.empty((3 + levels, numbers))
    whole = LaggedMoments(np.empty(numbers), np.empty(rows.shape[2:]), np.empty(bands.shape[2:]))
    for b in range(len(level)):
        first = b * WIDE
        count = min(WIDE, len(felt) - first)
        for i in range(count):
            angle[i], noise[i] = felt[first + i], variance[first + i]
        for i in range(count, WIDE):  # there are none: they stay where they are
            angle[i], noise[i] = 0.0, 1.0
        parts = LaggedMoments(means[b], rows[b], bands[b])
        for m in range(levels):
            each = LaggedMoments(parts.mean[m], parts.rows[m], parts.bands[m])
            for i in range(WIDE):
                total[i] = each.rows[0, i] + noise[i]
                residual[i] = angle[i] - each.mean[i]
            for i in range(WIDE):
                density = -0.5 * (residual[i] ** 2 / total[i] + np.log(2.0 * np.pi * total[i]))
                level[b, m, i] = log_prior[b, m, i] + density
            _condition(each, residual, total, about)
        for i in range(WIDE):
            density = _normalise(level[b], i)
            if i < count:
                log_density[first + i] = density
        _mix(level[b], parts, about, whole)
        _put_apart(whole, first, count, mixed)


@kernel()
def over_levels(level, moments, mixed):
    """Find the moments of each direction, whatever its level.

    Args:
        level: (B, M, W) probability of each level.
        moments: `LaggedMoments` of the state at each level, B by M of W side by side.
        mixed: `LaggedMoments` of C, filled.
    """
    means, rows, bands = moments
    about = np.empty((3 + means.shape[1], means.shape[2]))
    whole = LaggedMoments(np.empty(means.shape[2]), np.empty(rows.shape[2:]), np.empty(bands.shape[2:]))
    for b in range(len(level)):
        _mix(level[b], LaggedMoments(means[b], rows[b], bands[b]), about, whole)
        first = b * WIDE
        _put_apart(whole, first, min(WIDE, len(mixed.mean) - first), mixed)


@inner()
def _mix(share, parts, about, mixed):
    """Find the moments of mixtures that lie side by side.

    Args:
        share: (M, W) of each part.
        parts: the `LaggedMoments` of M Gaussians of W.
        about: (3 + M, S·W), scratch.
        mixed: the `LaggedMoments` of the W mixtures, filled.
    """
    means, rows, bands = parts
    mean, row, band = mixed
    apart, scaled, spread, shares = about[0], about[1], about[2], about[3:]
    fill(0.0, mean)
    for k in range(PRESENT):
        fill(0.0, row[k])
    for a in range(len(band)):
        fill(0.0, band[a])
    for n in range(len(share)):
        if any_above_zero(share[n]):
            repeat(share[n], shares[n])
            add_product(shares[n], means[n], mean)
    for n in range(len(share)):
        if any_above_zero(share[n]):
            set_apart(shares[n], means[n], mean, apart, scaled)
            for k in range(PRESENT):
                repeat(scaled[k * WIDE : (k + 1) * WIDE], spread)
                add_products(shares[n], rows[n, k], spread, apart, row[k])
            for a in range(len(band)):
                add_products(shares[n], bands[n, a], scaled[PRESENT * WIDE :], apart[(PRESENT + a) * WIDE :], band[a])


@inner()
def _move(transition, noise, before, now, moved):
    """Fill `moved` with what a step makes of `before`: angles become those of a step ago. `now` (3, S·W) is scratch."""
    mean, rows, bands = before
    moved_mean, moved_rows, moved_bands = moved
    here, size, lag = PRESENT * WIDE, len(mean), bands.shape[1]
    for i in range(PRESENT):
        a, b, c = transition[i, 0], transition[i, 1], transition[i, 2]
        sum_of_three(
            a, mean[:WIDE], b, mean[WIDE : 2 * WIDE], c, mean[2 * WIDE : here], moved_mean[i * WIDE : (i + 1) * WIDE]
        )
        sum_of_three(a, rows[0], b, rows[1], c, rows[2], now[i])  # what is now, moved, with what was
    for i in range(PRESENT):
        for j in range(PRESENT):
            target = moved_rows[i, j * WIDE : (j + 1) * WIDE]
            fill(noise[i, j], target)
            for k in range(PRESENT):
                add(transition[j, k], now[i, k * WIDE : (k + 1) * WIDE], target)
    if not lag:
        return
    copy(mean[:WIDE], moved_mean[here:])
    copy(mean[here : size - WIDE], moved_mean[here + WIDE :])
    for i in range(PRESENT):
        copy(now[i, :WIDE], moved_rows[i, here:])
        copy(now[i, here : size - WIDE], moved_rows[i, here + WIDE :])
    for a in range(len(bands)):
        with_now = (PRESENT - 1 + a) * WIDE if a else 0
        copy(rows[0, with_now : with_now + WIDE], moved_bands[a])
        copy(bands[a, : lag - (1 + a) * WIDE], moved_bands[a, WIDE:])


@inner()
def _condition(moments, residual, total, about):
    """Take in angles `residual` (W,) rad beyond what is expected, of variance `total`. `about` (3, S·W) is scratch."""
    mean, rows, bands = moments
    with_felt, scaled, repeated = about[0], about[1], about[2]
    copy(rows[0], with_felt)
    repeat(total, repeated)
    negative_share(with_felt, repeated, scaled)
    for i in range(WIDE):
        residual[i] = residual[i] / total[i]
    repeat(residual, repeated)
    add_product(repeated, with_felt, mean)
    for k in range(PRESENT):
        repeat(scaled[k * WIDE : (k + 1) * WIDE], repeated)
        add_product(repeated, with_felt, rows[k])
    for a in range(len(bands)):
        add_product(scaled[PRESENT * WIDE :], with_felt[(PRESENT + a) * WIDE :], bands[a])


@inner()
def _normalise(level, at):
    """Make probabilities of log probabilities (M, W), none of them zero, of one direction; the log of their sum."""
    highest = -np.inf
    for m in range(len(level)):
        highest = max(highest, level[m, at])
    total = 0.0
    for m in range(len(level)):
        level[m, at] = np.exp(level[m, at] - highest)
        total += level[m, at]
    whole = 0.0
    for m in range(len(level)):
        level[m, at] = max(level[m, at] / total, LEAST)
        whole += level[m, at]
    for m in range(len(level)):
        level[m, at] /= whole
    return highest + np.log(total)


@inner()
def _put_apart(together, first, count, apart):
    """Put the moments of so many that lie side by side one after the other, from the `first` on."""
    for w in range(count):
        take_each(together.mean, w, apart.mean[first + w])
        for k in range(PRESENT):
            take_each(together.rows[k], w, apart.rows[first + w, k])
        for a in range(len(together.bands)):
            take_each(together.bands[a], w, apart.bands[first + w, a])
