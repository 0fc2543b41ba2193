"""What contacts say of hypothetical solids: all that `ShapePosterior` computes at every step, compiled.

Shapes: H hypotheses, S pose samples, G parts of the hand, C columns of a sample, L links, P patches, J joints. Kernels
are pure: random numbers come in.
"""

from __future__ import annotations

import numpy as np

from haptic_env.compiled import inner, kernel, part
from observer.kinematics import body_frames
from observer.shape.distance_fields import field_distance, in_field

CLEAR = 4.0  # in tolerances: a patch with this gap is as good as far away
LEAST = 1e-290  # no weight is zero, so that every hypothesis keeps a sum to divide by


@part(fastmath=True)
def patch_gaps(solids, h, skin, link, position, rotation, clear, gaps):
    """Fill `gaps` (P,) of the patches of `link`, at `position` (3,) and `rotation` (3, 3), with their distance from
    hypothesis `h`, or `clear` m where it is more; whether any is less.

    Distance changes no faster than its place: what a look-up shows to be clear is skipped.
    """
    field = solids.field[solids.drawn_in[h]]
    scale, at, turn = solids.scale[h], solids.position[h], solids.rotation[h]
    resolution, half, far = solids.resolution, solids.half, solids.far
    # The link's frame in that of the field.
    p0, p1, p2 = in_field(turn, scale, position[0] - at[0], position[1] - at[1], position[2] - at[2])
    c0, c1, c2 = in_field(turn, scale, rotation[0, 2], rotation[1, 2], rotation[2, 2])
    s = skin.middle[link]
    gap = scale * field_distance(field, resolution, half, far, p0 + c0 * s, p1 + c1 * s, p2 + c2 * s)
    if gap - skin.ball[link] >= clear:
        return False
    a0, a1, a2 = in_field(turn, scale, rotation[0, 0], rotation[1, 0], rotation[2, 0])
    b0, b1, b2 = in_field(turn, scale, rotation[0, 1], rotation[1, 1], rotation[2, 1])
    for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
        gaps[patch] = clear
    near = False
    bead, last = skin.first_bead[link], skin.first_bead[link + 1]
    while bead < last:
        s, radius = skin.along[bead], skin.radius[bead]
        gap = scale * field_distance(field, resolution, half, far, p0 + c0 * s, p1 + c1 * s, p2 + c2 * s)
        upto = s + gap - radius - clear
        if upto >= s:
            bead += 1
            while bead < last and skin.along[bead] < upto and skin.radius[bead] <= radius:
                bead += 1
            continue
        near = True
        k, end = skin.begin[bead], skin.begin[bead + 1]
        while k < end:
            x, y, z = skin.points[k, 0], skin.points[k, 1], skin.points[k, 2]
            u, v, w = p0 + a0 * x + b0 * y + c0 * z, p1 + a1 * x + b1 * y + c1 * z, p2 + a2 * x + b2 * y + c2 * z
            gap = scale * field_distance(field, resolution, half, far, u, v, w)
            gaps[skin.patch[k]] = min(gaps[skin.patch[k]], gap)
            upto = skin.travel[k] + gap - clear
            k += 1
            while k < end and skin.travel[k] < upto:
                k += 1
        bead += 1
    return near


@part(fastmath=True)
def link_likelihood(
    solids, h, skin, link, position, rotation, contacts, touches, tolerance, press, surprise, news, gaps
):
    """p(z_l | q, h) of `link` at `position` (3,) and `rotation` (3, 3), with the exponent `news`: of its patches
    `touches` feel contact, those in `contacts` (P,). `tolerance` m: the SD of a gap; `gaps` (P,) is scratch.

    That a link feels nothing is one event, its nearest patch is clear: an error of the pose moves all of them together.
    Silent patches of a link that feels contact lie no deeper than those that ring, which may be `press` m inside; that
    they are as near says nothing, for the physics has few points of contact a link, however flat it lies.
    """
    clear = CLEAR * tolerance
    if not patch_gaps(solids, h, skin, link, position, rotation, clear, gaps):
        return surprise ** (news * touches) if touches > 0 else 1.0
    told, touched, silent = 1.0, clear, clear
    for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
        gap = gaps[patch]
        if not contacts[patch]:
            silent = min(silent, gap)
            continue
        touched = min(touched, gap)
        ratio = (min(gap + press, 0.0) if gap < 0.0 else gap) / tolerance
        fit = np.exp(-0.5 * ratio * ratio) if ratio < CLEAR else 0.0
        told *= surprise + (1.0 - surprise) * fit
    ratio = silent / tolerance
    if touches > 0:
        ratio += 1.0 + (press - touched) / tolerance
    if ratio < CLEAR:
        # A normal's distribution function, nearly.
        told *= surprise + (1.0 - surprise) / (1.0 + np.exp(-1.7 * ratio))
    return told**news if told < 1.0 else 1.0


@inner(fastmath=True)
def _part_likelihood(skin, solids, g, frames, contacts, touches, tolerance, press, surprise, news, gaps, likelihood):
    """Fill `likelihood` (H,) with p(z_g | q, h) of part `g`, whose bodies have `frames` (B, 3) and (B, 3, 3); `touches`
    (L,) count the contacts of each link, what it says has the exponent `news` (L,); `gaps` (P,) is scratch."""
    position, rotation = frames
    for h in range(len(likelihood)):
        likelihood[h] = 1.0
    for link in range(len(skin.body)):
        if skin.group[link] != g or news[link] <= 0.0:
            continue
        body = skin.body[link]
        for h in range(len(likelihood)):
            likelihood[h] *= link_likelihood(
                solids,
                h,
                skin,
                link,
                position[body],
                rotation[body],
                contacts,
                touches[link],
                tolerance[link],
                press,
                surprise,
                news[link],
                gaps,
            )


@kernel(fastmath=True)
def contact_likelihood(tree, skin, solids, poses, column, contacts, tolerance, press, surprise, news, out):
    """Fill `out` (G, H, S) with p(z_g | q, h) of what each part g feels at each of the `poses` (S, C), in which it
    finds its joints in its `column` (G, J); the SD of a gap is the `tolerance` (L,) m of its link, and what a link says
    counts with the exponent `news` (L,), as `link_likelihood` has it.
    """
    parts, _, samples = out.shape
    links = len(skin.body)
    touches = np.zeros(links, dtype=np.int64)
    for link in range(links):
        for patch in range(skin.first_patch[link], skin.first_patch[link + 1]):
            touches[link] += contacts[patch]
    for s in range(samples):
        position = np.empty((len(tree.parent), 3))
        rotation = np.empty((len(tree.parent), 3, 3))
        gaps = np.empty(len(contacts))
        angles = np.empty(column.shape[1])
        for g in range(parts):
            if g == 0 or poses.shape[1] > len(angles):  # else all parts read the same columns
                for j in range(len(angles)):
                    angles[j] = poses[s, column[g, j]]
                body_frames(tree, angles, position, rotation)
            _part_likelihood(
                skin,
                solids,
                g,
                (position, rotation),
                contacts,
                touches,
                tolerance,
                press,
                surprise,
                news,
                gaps,
                out[g, :, s],
            )


@kernel()
def weigh(weights, likelihood, temper, log_evidence):
    """Multiply `weights` (G, H, S) by `likelihood` (G, H, S) and normalise them over samples; `temper` times the logs
    of the sums are added to `log_evidence` (H,)."""
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
    """Resample the poses (S, C) of each part, the `part` (C,) that a column belongs to, for which the effective number,
    the mean over hypotheses by their `share` (H,), is below half of the samples; systematically (one of `uniform` (G,)
    for each), from the mixture of the hypotheses' `weights` (G, H, S), which become what each hypothesis has more than
    the mixture."""
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
