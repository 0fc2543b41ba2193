"""The compiled kernels once more in plain NumPy, slow and short: what they have to agree with.

N particles, J joints, K candidates, L links, P patches, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

import numpy as np

from observer.contact_model import ContactModel
from observer.kernels import LIMIT, QUANTUM
from observer.kinematics import link_frames, tree_of


def full_weight(**keywords):
    """A contact model whose touches count in full at every step, in the shell and nowhere beyond."""
    return ContactModel(**{"touch": 1.0, "sustained": 1.0, "fall": 1e-6, "temper": 1.0, "least": 0.0, **keywords})


def probability(log_odds):
    """Of map entries, int8 log-odds in units of `QUANTUM`."""
    return 1 / (1 + np.exp(-QUANTUM * np.asarray(log_odds, dtype=float)))


def log_likelihood(hand, grid, model, q, contacts, watched, log_odds):
    """log p(z | q, m) of the patches of the `watched` (L,) links: one noisy-OR a patch.

    A touch: the cells half a voxel above the skin, at least one of them rings or a false alarm does. Silence: of the
    cells half a voxel beneath it none that is known to be occupied rings.
    """
    at, turn = link_frames(tree_of(hand), q)
    skin = hand.patches.surface(1.5 * grid.resolution)
    total = 0.0
    for patch in range(len(hand.patches)):
        link = hand.patches.link[patch]
        if not watched[link]:
            continue
        mine = skin.patch == patch
        lift = (0.5 if contacts[patch] else -0.5) * grid.resolution
        points = at[link] + (skin.points[mine] + lift * skin.normals[mine]) @ turn[link].T
        silent = 1 - model.false_alarm if contacts[patch] else 1.0
        for cell, inside in zip(*grid.index(points), strict=True):
            if contacts[patch]:
                occupied = probability(log_odds[tuple(cell)]) if inside else 0.5
            else:
                occupied = max(0.0, 2 * probability(log_odds[tuple(cell)]) - 1) if inside else 0.0
            silent *= 1 - model.hit * occupied
        total += np.log(max(1 - silent if contacts[patch] else silent, 1e-6))
    return total


def write(hand, grid, model, q, margin, contacts, touch, log_odds):
    """The map after one pose: (X, Y, Z) log-odds, and which entries were written.

    Link by link: cells deeper than `margin` (L,) beneath the skin are free. The cells from there to the shell above a
    patch that feels contact, and with less and less a part beyond it, share its noisy-OR: each gets the log ratio of
    its likelihoods, occupied to free, the others being what the map says, times `touch` (P,).
    """
    at, turn = link_frames(tree_of(hand), q)
    result, known = log_odds.astype(int), np.zeros(log_odds.shape, dtype=bool)
    free = round(model.free / QUANTUM)
    shell, fall = model.shell * grid.resolution, model.fall * grid.resolution
    for index, link in enumerate(hand.links):
        local = (grid.centres() - at[index]) @ turn[index]
        bone = np.clip(local[..., 2:], 0, link.length) * [0, 0, 1]
        height = np.linalg.norm(local - bone, axis=-1) - link.radius
        inner = height < -min(margin[index], link.radius)
        result[inner] = np.maximum(result[inner] - free, -LIMIT)
        known |= inner
        about = ~inner & (height < shell + 2 * fall)
        cells = np.argwhere(about)
        if len(cells) == 0:
            continue
        owner = hand.patches.locate(np.full(len(cells), index), local[about])
        hit = model.hit * np.exp(-0.5 * (np.maximum(height[about] - shell, 0) / fall) ** 2)
        for patch in np.unique(owner[contacts[owner]]):
            mine = owner == patch
            suspects, hits = cells[mine], hit[mine]
            ring = hits * probability([result[tuple(cell)] for cell in suspects])
            gains = []
            for c in range(len(suspects)):
                others = (1 - model.false_alarm) * np.prod(np.delete(1 - ring, c))
                ratio = (1 - (1 - hits[c]) * others) / (1 - others)
                gains.append(touch[patch] * np.log(ratio) if np.log(ratio) >= model.least else None)
            for cell, gain in zip(suspects, gains, strict=True):
                if gain is not None:
                    result[tuple(cell)] = min(result[tuple(cell)] + round(gain / QUANTUM), LIMIT)
                    known[tuple(cell)] = True
    return result.astype(np.int8), known


def advance(hand, grid, model, contacts, touch, average, watched, margin, centres, spread, normals, uniform, maps):
    """Candidates, scores, the matched pose and the new map of every particle: log mean likelihood (N,), moved (N,),
    poses (N, J), the candidates' mean if `average`, else one of them, maps (N, X, Y, Z), known (X, Y, Z)."""
    log_means, moved, poses, new_maps = [], [], [], []
    known = np.zeros(maps.shape[1:], dtype=bool)
    for n in range(len(maps)):
        candidates = centres[n] + normals[n] @ spread.T
        score = [log_likelihood(hand, grid, model, q, contacts, watched, maps[n]) for q in candidates]
        likelihood = np.exp(model.temper * np.array(score))
        chosen = int(np.searchsorted(np.cumsum(likelihood), uniform[n] * likelihood.sum()))
        q = likelihood @ candidates / likelihood.sum() if average else candidates[chosen]
        log_means.append(np.log(likelihood.mean()))
        moved.append(likelihood.min() < 0.5 * likelihood.max())
        poses.append(q)
        new, wrote = write(hand, grid, model, q, margin, contacts, touch, maps[n])
        new_maps.append(new)
        known |= wrote
    return np.array(log_means), np.array(moved), np.array(poses), np.array(new_maps), known
