"""How particles match their poses to their maps, and write what was felt there: by name, in `MATCHING`.

Shapes: N particles, J joints, P patches, L links, K candidates. Angles in radians.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.moved import renamed
from observer import threads
from observer.gaussian import lower_factor
from observer.kinematics import Tree
from observer.maps import free_space, per_particle, scan_matching, suspects
from observer.maps.capsules import Body, Lattice
from observer.maps.evidence import Evidence, LinkEvidence
from observer.maps.mean_frames import MeanFrames
from observer.maps.occupancy import Maps

__getattr__ = renamed(__name__, {"Felt": "MapInput"})


class MapInput(NamedTuple):
    """What one step has to say to the maps: `contacts` (P,) and `touch` (P,), the weight of each patch's touch;
    `watched` (L,): the links whose patches have a say in the pose; and what it says of the cells about a link."""

    tree: Tree
    body: Body
    lattice: Lattice
    evidence: Evidence
    reach: LinkEvidence
    contacts: NDArray[np.bool_]
    touch: Array
    watched: NDArray[np.bool_]


class Cloud(NamedTuple):
    """Where the particles' proposals lie: `centres` (N, J) from the mean pose, that of `stance`, each with the
    covariance `rest` (J, J); `spread` (J, J): factor of the covariance of all that is uncertain of the pose."""

    stance: MeanFrames
    centres: Array
    rest: Array
    spread: Array


class Search(NamedTuple):
    """All that the `kernel` needs to match particles to their maps, side by side, but for what it fills; its poses are
    `about` (J,) rad."""

    kernel: Callable[..., None]
    arguments: tuple[Any, ...]
    about: Array | None = None


def mean_search(felt: MapInput, cloud: Cloud, candidates: int, maps: Maps, rng: np.random.Generator) -> Search | None:
    """Every particle takes the mean of its candidates by likelihood, which come from all that is uncertain of the
    pose, in pairs about the centre: where the map has nothing to say nothing moves. What the pose's uncertainty does
    to the maps is in `LinkEvidence`, the same for all, so that sweeps are said once. None where no contact is."""
    particles, joints = cloud.centres.shape
    tree, body, lattice, evidence, reach, contacts, touch, watched = felt
    stance = cloud.stance
    if not watched.any():  # effort goes where contact is
        return None
    # Voxels that a candidate may be away; a single one of a single particle is where the pose is.
    about = 1 + int(2.0 * reach.place.max() / lattice.resolution) if particles * candidates > 1 else 1
    scan = scan_matching.scan(tree, body, lattice, stance, contacts, watched, maps.solid, about)
    margin = 0.5 * lattice.resolution
    causes = suspects.suspects_of(tree, body, lattice, evidence, reach, stance, contacts, touch, margin)
    arguments = (
        scan,
        causes,
        maps.make_room(causes.cell),
        lattice,
        evidence,
        candidates,
        cloud.centres,
        cloud.spread,
        rng.standard_normal((particles, candidates // 2, joints), dtype=np.float32),  # twice as fast to draw
        maps.common,
        maps.slot,
        maps.own,
        maps.touched,
        maps.solid,
    )
    return Search(scan_matching.match_and_touch, arguments, stance.pose)


def sample_search(felt: MapInput, cloud: Cloud, candidates: int, maps: Maps, rng: np.random.Generator) -> Search:
    """Every particle takes one of its candidates, drawn by likelihood from its proposal, and has the whole of its map
    at its own pose."""
    particles, joints = cloud.centres.shape
    arguments = (
        *felt,
        cloud.stance.pose + cloud.centres,
        lower_factor(cloud.rest),
        rng.standard_normal((particles, candidates if felt.watched.any() else 1, joints)),
        rng.random(particles),
        maps.own,
        maps.stale,
    )
    return Search(per_particle.advance, arguments)


def match(search: Search | None, cloud: Cloud, poses: Array, number: int) -> tuple[Array, NDArray[np.bool_]]:
    """Fill `poses` (N, J) with those that match the maps, on `number` threads, and write into these what is felt there;
    returns the log of the mean likelihood (N,) and whether the match moved the pose (N,)."""
    log_likelihood, moved = np.zeros(len(poses)), np.zeros(len(poses), dtype=bool)
    if search is None:
        np.add(cloud.stance.pose, cloud.centres, out=poses)
        return log_likelihood, moved
    threads.run(search.kernel, len(poses), number, *search.arguments, poses, log_likelihood, moved)
    if search.about is not None:
        poses += search.about
    return log_likelihood, moved


def sweep(felt: MapInput, stance: MeanFrames, maps: Maps, carve: bool) -> None:
    """Take note of what the hand came near, and `carve` the free space out of what all particles have in common; where
    that is not asked for, each has carved its own."""
    if not carve:
        maps.seen |= maps.stale
    where, loses = free_space.sweep_free(
        felt.tree,
        felt.body,
        felt.lattice,
        felt.evidence,
        felt.reach,
        stance,
        felt.contacts,
        carve,
        maps.common,
        maps.slot,
        maps.seen,
        maps.stale,
    )
    if len(where):
        free_space.lose(where, loses, maps.own)


MATCHING: dict[str, Callable[..., Search | None]] = {"mean": mean_search, "sample": sample_search}
