"""The compiled kernels once more in plain NumPy, slow and short: what they have to agree with.

N particles, J joints, K candidates, L links, P patches, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import expit, logit
from scipy.stats import norm

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from observer.kinematics import link_frames, tree_of
from observer.maps.contact_model import BINS, LIMIT, QUANTUM, ContactModel


def full_weight(**keywords: float) -> ContactModel:
    """Make a contact model whose touches count in full at every step, in the shell and nowhere beyond.

    Args:
        **keywords: of `ContactModel`, which win over that.

    Returns:
        The model.
    """
    plain = {"prior": 0.5, "touch": 1.0, "sustained": 1.0, "fall": 1e-6, "caution": 0.0, "temper": 1.0}
    return ContactModel(**{**plain, **keywords})


def probability(model: ContactModel, log_odds: ArrayLike) -> Array:
    """Convert entries of a map.

    Args:
        model: has the prior.
        log_odds: int8, above those of the prior, in units of `QUANTUM`; of any shape.

    Returns:
        Probability that each cell is occupied.
    """
    return expit(logit(model.prior) + QUANTUM * np.asarray(log_odds, dtype=float))


def log_likelihood(
    hand: Hand, grid: Grid, model: ContactModel, q: Array, contacts: Any, watched: Any, log_odds: Any
) -> float:
    """Score contacts at a pose, log p(z | q, m): one noisy-OR a patch.

    A touch: of the cells half a voxel above the skin at least one rings, or a false alarm does. Silence: of the cells
    half a voxel beneath it none that is known to be occupied rings.

    Args:
        hand: with the skin.
        grid: of the map.
        model: of the contacts.
        q: (J,) rad.
        contacts: (P,) of all patches.
        watched: (L,) whether the patches of a link count.
        log_odds: (X, Y, Z), the map.

    Returns:
        Natural logarithm.
    """
    at, turn = link_frames(tree_of(hand), q)
    skin = hand.patches.surface(2.0 * grid.resolution)
    total = 0.0
    for patch in range(len(hand.patches)):
        link = hand.patches.link[patch]
        if not watched[link]:
            continue
        mine = skin.patch == patch
        lift = (0.5 if contacts[patch] else -0.5) * grid.resolution
        points = at[link] + (skin.points[mine] + lift * skin.normals[mine]) @ turn[link].T
        silent: Any = 1 - model.false_alarm if contacts[patch] else 1.0
        for cell, inside in zip(*grid.index(points), strict=True):
            if contacts[patch]:
                occupied: Any = probability(model, log_odds[tuple(cell)]) if inside else model.prior
            else:
                occupied = max(0.0, 2 * probability(model, log_odds[tuple(cell)]) - 1) if inside else 0.0
            silent *= 1 - model.hit * occupied
        total += np.log(max(1 - silent if contacts[patch] else silent, 1e-6))
    return total


def height(hand: Hand, grid: Grid, q: Array) -> Array:
    """Measure how far voxels are from the skin.

    Args:
        hand: with the skin.
        grid: of the voxels.
        q: (J,) rad.

    Returns:
        (X, Y, Z) m, from the centre of each voxel; below 0 inside a link.
    """
    at, turn = link_frames(tree_of(hand), q)
    each = []
    for index, link in enumerate(hand.links):
        local = (grid.centres() - at[index]) @ turn[index]
        bone = np.clip(local[..., 2:], 0, link.length) * [0, 0, 1]
        each.append(np.linalg.norm(local - bone, axis=-1) - link.radius)
    return np.min(each, axis=0)


def write(
    hand: Hand, grid: Grid, model: ContactModel, q: Array, place: Array, contacts: Any, touch: Any, log_odds: Any
) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
    """Update a map with one pose.

    A cell at some depth in a link loses the log of a normal distribution's tail there. The cells about the skin of a
    patch that feels contact lose nothing and share its noisy-OR: each gets the log ratio of its likelihoods, occupied
    to free, the others being what the map says.

    Args:
        hand: with the skin.
        grid: of the map.
        model: of the contacts.
        q: (J,) rad.
        place: (L,) m, SD of the place of each link.
        contacts: (P,).
        touch: (P,) weight of each touch.
        log_odds: (X, Y, Z), the map.

    Returns:
        The map after it (X, Y, Z), and which of its entries were written (X, Y, Z).
    """
    at, turn = link_frames(tree_of(hand), q)
    result, known = log_odds.astype(int), np.zeros(log_odds.shape, dtype=bool)
    lengths = (model.give, model.edge, model.deep, model.shell, model.fall)
    give, edge, deep, shell, fall = (grid.resolution * each for each in lengths)
    for index, link in enumerate(hand.links):
        local = (grid.centres() - at[index]) @ turn[index]
        bone = np.clip(local[..., 2:], 0, link.length) * [0, 0, 1]
        distance = np.linalg.norm(local - bone, axis=-1)
        height = distance - link.radius
        fade = np.hypot(fall, model.blur * place[index])
        owner = hand.patches.locate(np.full(height.size, index), local.reshape(-1, 3)).reshape(height.shape)
        suspect = (height >= -deep) & (height < shell + 2.5 * fade) & contacts[owner]

        bin = (link.radius + 2 * edge) ** 2 / BINS  # of the squared distance: the kernel has a table
        middle = np.sqrt((np.floor(distance**2 / bin) + 0.5) * bin) - link.radius
        lost = -model.free * norm.logcdf((middle + give) / np.hypot(place[index], edge))
        lost = np.minimum(np.round(lost / QUANTUM), LIMIT).astype(int)
        carved = ~suspect & (height < 2 * edge) & (lost > 0)
        result[carved] = np.maximum(result[carved] - lost[carved], -LIMIT)
        known |= carved

        hit = model.hit * np.exp(-0.5 * (np.maximum(height - shell, 0) / fade) ** 2)
        for patch in np.unique(owner[suspect]):
            mine = suspect & (owner == patch)
            hits = hit[mine]
            ring = hits * probability(model, result[mine])
            gains = []
            for c in range(len(hits)):
                others = (1 - model.false_alarm) * np.prod(np.delete(1 - ring, c))
                ratio = (1 - (1 - hits[c]) * others) / (1 - others)
                gains.append(round(touch[patch] * np.log(ratio) / QUANTUM))
            result[mine] = np.minimum(result[mine] + gains, LIMIT)
            known |= mine
    return result.astype(np.int8), known


def advance(
    hand: Hand,
    grid: Grid,
    model: ContactModel,
    contacts: Any,
    touch: Any,
    watched: Any,
    place: Array,
    centres: Array,
    spread: Array,
    normals: Array,
    uniform: Array,
    maps: Any,
) -> tuple[Array, NDArray[np.bool_], Array, NDArray[np.int8], NDArray[np.bool_]]:
    """Take one step of every particle: candidates, scores, the matched pose, the new map.

    Args:
        hand: with the skin.
        grid: of the maps.
        model: of the contacts.
        contacts: (P,).
        touch: (P,) weight of each touch.
        watched: (L,) whether the patches of a link count in scores.
        place: (L,) m, SD of the place of each link.
        centres: (N, J) rad, about which candidates lie.
        spread: (J, J) rad, Cholesky factor of their covariance.
        normals: (N, K, J) standard normal numbers that make the candidates.
        uniform: (N,) in [0, 1), which choose among them.
        maps: (N, X, Y, Z).

    Returns:
        Log mean likelihood (N,), whether scores told candidates apart (N,), poses (N, J) rad, one of the candidates
        each, maps (N, X, Y, Z), and which cells any particle wrote (X, Y, Z).
    """
    log_means, moved, poses, new_maps = [], [], [], []
    known = np.zeros(maps.shape[1:], dtype=bool)
    for n in range(len(maps)):
        candidates = centres[n] + normals[n] @ spread.T
        score = [log_likelihood(hand, grid, model, q, contacts, watched, maps[n]) for q in candidates]
        likelihood = np.exp(model.temper * np.array(score))
        chosen = int(np.searchsorted(np.cumsum(likelihood), uniform[n] * likelihood.sum()))
        q = candidates[chosen]
        log_means.append(np.log(likelihood.mean()))
        moved.append(likelihood.min() < 0.5 * likelihood.max())
        poses.append(q)
        new, wrote = write(hand, grid, model, q, place, contacts, touch, maps[n])
        new_maps.append(new)
        known |= wrote
    return np.array(log_means), np.array(moved), np.array(poses), np.array(new_maps), known
