"""What contacts say of hypothetical solids: all that `ShapePosterior` computes at every step, compiled.

Shapes: H hypotheses, S pose samples, G parts of the hand, C columns of a sample, L links, P patches, J joints. Kernels
are pure: random numbers come in.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part
from observer.kinematics import body_frames
from observer.shape.link_gaps import felt_gaps, scratch_of, uncertain_gaps

CLEAR = 4.0  # in tolerances: a patch with this gap is as good as far away
THIN = 0.002  # m by which flesh must be deeper inside than any patch: points of the skin are some way apart
UNKNOWN = -1  # of a contact: it was not measured, or by a patch that is believed not to work
UNFELT = 3.0  # in tolerances: flesh beneath skin that feels nothing may be as deep as that for an error of the pose
USUAL = 0.002  # m, SD of a surface from which on it costs anything that a touch might have been elsewhere
ELSEWHERE = 0.7  # exponent of that: touches nearby share one error of the surface
LEAST = 1e-290  # no weight is zero, so that every hypothesis keeps a sum to divide by


class TouchModel(NamedTuple):
    """How well the gap between a link and a solid says what the link feels.

    Attributes:
        tolerance: m, SD of a gap; of all links (L,) or of one.
        press: m, how deep what feels contact may lie inside.
        surprise: probability of what the model cannot explain.
    """

    tolerance: Array | float
    press: float
    surprise: float


class WeighedTouch(NamedTuple):
    """What links feel.

    Attributes:
        contacts: (P,) 1 or 0; `UNKNOWN` of patches that say nothing.
        touches: how many patches of a link feel contact; of all links (L,) or of one.
        exponent: of its likelihood; likewise.
    """

    contacts: NDArray[np.int8]
    touches: NDArray[np.int64] | int
    exponent: Array | float


class PoseSamples(NamedTuple):
    """Samples of the pose.

    Attributes:
        poses: (S, C) rad.
        column: (G, J) in which each part of the hand finds its joints.
    """

    poses: Array
    column: NDArray[np.int64]


@part(fastmath=True)
def link_likelihood(solids, h, skin, link, frame, felt, model, scratch):
    """Tell how probable it is that a link feels what it does, p(z_l | q, h).

    That a link feels nothing is one event, its nearest patch is clear: an error of the pose moves all of them together.
    Silent patches of a link that feels contact lie no deeper than those that ring, which may be `press` m inside; that
    they are as near says nothing, for the physics has few points of contact a link, however flat it lies. Skin of which
    nothing is known may touch, but the flesh beneath it is not inside.

    Args:
        solids: the distance fields.
        h: index of the hypothesis.
        skin: of the hand.
        link: index.
        frame: of the link, position (3,) m and rotation (3, 3).
        felt: the `WeighedTouch` of it.
        model: the `TouchModel` of it.
        scratch: the `GapScratch`.

    Returns:
        The probability to the power of the exponent.
    """
    contacts, touches, exponent = felt
    tolerance, press, surprise = model
    if solids.spread[solids.drawn_in[h]] >= 0:
        return _uncertain_likelihood(solids, h, skin, link, frame, felt, model, scratch)
    clear = CLEAR * tolerance
    flesh, silent = felt_gaps(solids, h, skin, link, frame, (contacts, touches), clear, scratch)
    if flesh >= clear:
        return surprise ** (exponent * touches) if touches > 0 else 1.0
    told, touched = 1.0, clear
    if touches > 0:
        for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
            if contacts[patch] <= 0:
                continue
            gap = scratch.gaps[patch]
            touched = min(touched, gap)
            if press > CLEAR * tolerance:  # as one-sided as silence: else lean solids win wherever the pose is vague
                fit = 1.0 / (1.0 + np.exp(1.7 * max(gap, -press) / tolerance)) if gap < clear else 0.0
            else:
                ratio = (min(gap + press, 0.0) if gap < 0.0 else gap) / tolerance
                fit = np.exp(-0.5 * ratio * ratio) if ratio < CLEAR else 0.0
            told *= surprise + (1.0 - surprise) * fit
    shallow = min(silent, touched) - THIN
    if flesh < shallow and solids.exact[solids.drawn_in[h]]:
        if _numb(skin, link, contacts):
            flesh += press + UNFELT * tolerance
        if flesh < shallow:
            silent = flesh
    ratio = silent / tolerance
    if touches > 0:
        ratio += 1.0 + (press - touched) / tolerance
    if ratio < CLEAR:
        # A normal's distribution function, nearly.
        told *= surprise + (1.0 - surprise) / (1.0 + np.exp(-1.7 * ratio))
    return told**exponent if told < 1.0 else 1.0


@part(fastmath=True)
def _uncertain_likelihood(solids, h, skin, link, frame, felt, model, scratch):
    """Tell the same of a solid whose surface is known with an SD: of one error for all that is felt nearby.

    A gap counts in SDs of both the hand and the surface; that a touch might have been elsewhere costs less than if it
    were news each time; and silence counts by the share that the hand has in the variance.

    Returns:
        As `link_likelihood`.
    """
    contacts, touches, exponent = felt
    tolerance, press, surprise = model
    silent, std = uncertain_gaps(solids, h, skin, link, frame, contacts, (tolerance, CLEAR), scratch)
    told, touched, nearest = 1.0, CLEAR, silent
    if touches > 0:
        for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
            if contacts[patch] <= 0:
                continue
            nearest = min(nearest, scratch.gaps[patch])
            ratio, vague = scratch.gaps[patch], scratch.stds[patch]
            deep = press / np.sqrt(tolerance * tolerance + vague * vague)
            touched = min(touched, ratio - deep)
            if press > CLEAR * tolerance:
                fit = 1.0 / (1.0 + np.exp(1.7 * max(ratio, -deep))) if ratio < CLEAR else 0.0
            else:
                ratio = min(ratio + deep, 0.0) if ratio < 0.0 else ratio
                fit = np.exp(-0.5 * ratio * ratio) if ratio < CLEAR else 0.0
            told *= surprise + (1.0 - surprise) * fit * (1.0 + (vague / USUAL) ** 2) ** (-0.5 * ELSEWHERE)
    if nearest >= CLEAR:
        return surprise ** (exponent * touches) if touches > 0 else 1.0
    ratio = silent
    if touches > 0:
        ratio += 1.0 - touched
    if ratio < CLEAR:
        clear = surprise + (1.0 - surprise) / (1.0 + np.exp(-1.7 * ratio))
        told *= clear ** (1.0 / (1.0 + (std / tolerance) ** 2))
    return told**exponent if told < 1.0 else 1.0


@part()
def _numb(skin, link, contacts):
    """Whether a link has skin that says nothing."""
    numb = skin.numb[link]
    for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
        numb |= contacts[patch] == UNKNOWN
    return numb


@inner(fastmath=True)
def _part_likelihood(skin, solids, g, frames, felt, model, scratch, likelihood):
    """Fill `likelihood` (H,) with p(z_g | q, h) of part `g`, whose bodies have `frames` (B, 3) and (B, 3, 3); `felt`
    and `model` are those of all links, `scratch` a `GapScratch`."""
    position, rotation = frames
    for h in range(len(likelihood)):
        likelihood[h] = 1.0
    for link in range(len(skin.body)):
        if skin.group[link] != g or felt.exponent[link] <= 0.0:
            continue
        frame = position[skin.body[link]], rotation[skin.body[link]]
        for h in range(len(likelihood)):
            # Made for each: outside the loop, with `fastmath`, divisions by the tolerance would round otherwise.
            mine = WeighedTouch(felt.contacts, felt.touches[link], felt.exponent[link])
            of_link = TouchModel(model.tolerance[link], model.press, model.surprise)
            likelihood[h] *= link_likelihood(solids, h, skin, link, frame, mine, of_link, scratch)


@kernel(fastmath=True)
def contact_likelihood(tree, skin, solids, samples, contacts, exponent, model, out):
    """Tell how probable it is that the parts of a hand feel what they do, p(z_g | q, h); see `link_likelihood`.

    Args:
        tree: the hand's kinematics.
        skin: of the hand.
        solids: the distance fields of H hypotheses.
        samples: the `PoseSamples`.
        contacts: (P,) 1, 0 or `UNKNOWN`.
        exponent: (L,) with which counts what each link says.
        model: the `TouchModel` of all links.
        out: (G, H, S), filled.
    """
    parts, _, number = out.shape
    poses, column = samples
    links = len(skin.body)
    touches = np.zeros(links, dtype=np.int64)
    for link in range(links):
        for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
            touches[link] += contacts[patch] > 0
    felt = WeighedTouch(contacts, touches, exponent)
    for s in range(number):
        position = np.empty((len(tree.parent), 3))
        rotation = np.empty((len(tree.parent), 3, 3))
        scratch = scratch_of(skin, len(contacts))
        angles = np.empty(column.shape[1])
        for g in range(parts):
            if g == 0 or poses.shape[1] > len(angles):  # else all parts read the same columns
                for j in range(len(angles)):
                    angles[j] = poses[s, column[g, j]]
                body_frames(tree, angles, position, rotation)
            _part_likelihood(skin, solids, g, (position, rotation), felt, model, scratch, out[g, :, s])


@kernel()
def weigh(weights, likelihood, temper, log_evidence):
    """Multiply weights by a likelihood, and normalise them over samples.

    Args:
        weights: (G, H, S), changed.
        likelihood: (G, H, S).
        temper: exponent of the evidence.
        log_evidence: (H,), to which `temper` times the logs of the sums are added.
    """
    parts, count, samples = weights.shape
    for g in range(parts):
        for h in range(count):
            total = 0.0
            for s in range(samples):
                weights[g, h, s] = max(weights[g, h, s] * likelihood[g, h, s], LEAST)
                total += weights[g, h, s]
            for s in range(samples):
                weights[g, h, s] /= total
            log_evidence[h] += temper * np.log(total)


@kernel()
def resample(weights, share, poses, part, uniform):
    """Resample the poses of each part for which the effective number is below half of the samples: systematically, from
    the mixture of the hypotheses' weights, which become what each hypothesis has more than the mixture.

    Args:
        weights: (G, H, S), changed.
        share: (H,) of the hypotheses in the mixture, and in the mean of the effective numbers.
        poses: (S, C) rad, changed.
        part: (C,) that a column belongs to.
        uniform: (G,) random numbers.
    """
    parts, count, samples = weights.shape
    source, mixture, kept = np.empty(samples, dtype=np.int64), np.empty(samples), np.empty(samples)
    for g in range(parts):
        effective = 0.0
        for s in range(samples):
            mixture[s] = 0.0
        for h in range(count):
            square = 0.0
            for s in range(samples):
                mixture[s] += share[h] * weights[g, h, s]
                square += weights[g, h, s] ** 2
            effective += share[h] / square
        if effective >= 0.5 * samples:
            continue
        reached, chosen, total = mixture[0], 0, 0.0
        for s in range(samples):
            total += mixture[s]
        for s in range(samples):
            while reached < (s + uniform[g]) / samples * total and chosen < samples - 1:
                chosen += 1
                reached += mixture[chosen]
            source[s] = chosen
        for j in range(poses.shape[1]):
            if part[j] == g:
                for s in range(samples):
                    kept[s] = poses[source[s], j]
                for s in range(samples):
                    poses[s, j] = kept[s]
        for h in range(count):
            total = 0.0
            for s in range(samples):
                kept[s] = weights[g, h, source[s]] / mixture[source[s]]
                total += kept[s]
            # Where the mixture has left a hypothesis no sample worth the name, it starts anew.
            for s in range(samples):
                weights[g, h, s] = kept[s] / total if total > 1e-200 else 1.0 / samples
