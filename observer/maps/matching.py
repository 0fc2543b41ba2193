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
from observer.maps import free_space, matching_geometry, per_particle, scan_matching
from observer.maps.capsules import MapInput, MeanFrames
from observer.maps.occupancy import Maps
from observer.maps.scan_matching import Candidates, MapQuery, Matched

__getattr__ = renamed(__name__, {"Felt": "MapInput"})


class Cloud(NamedTuple):
    """Where the particles' proposals lie.

    Attributes:
        stance: of the mean pose.
        centres: (N, J) rad from the mean pose.
        rest: (J, J) rad², covariance of each proposal.
        spread: (J, J) rad, factor of the covariance of all that is uncertain of the pose.
    """

    stance: MeanFrames
    centres: Array
    rest: Array
    spread: Array


class Search(NamedTuple):
    """How particles are matched to their maps, side by side.

    Attributes:
        kernel: called with the first particle, the one after the last, the `arguments`, and the `Matched` to fill.
        arguments: of the kernel.
        about: (J,) rad, what its poses are from; None: 0.
    """

    kernel: Callable[..., None]
    arguments: tuple[Any, ...]
    about: Array | None = None


def mean_search(felt: MapInput, cloud: Cloud, candidates: int, maps: Maps, rng: np.random.Generator) -> Search | None:
    """Let every particle take the mean of its candidates by likelihood.

    These come from all that is uncertain of the pose, in pairs about the centre: where the map has nothing to say
    nothing moves. What the pose's uncertainty does to the maps is in `LinkEvidence`, the same for all, so that sweeps
    are said once.

    Args:
        felt: of the step.
        cloud: the proposals.
        candidates: K.
        maps: of the particles; they make room.
        rng: draws the candidates.

    Returns:
        The search; None where no contact is.
    """
    particles, joints = cloud.centres.shape
    if not felt.watched.any():  # effort goes where contact is
        return None
    resolution = felt.lattice.resolution
    # Voxels that a candidate may be away; a single one of a single particle is where the pose is.
    about = 1 + int(2.0 * felt.reach.place.max() / resolution) if particles * candidates > 1 else 1
    skin, causes = matching_geometry.survey(felt, cloud.stance, maps.solid, about, 0.5 * resolution)
    query = MapQuery(skin, causes, maps.make_room(causes.cell))
    normals = rng.standard_normal((particles, candidates // 2, joints), dtype=np.float32)  # twice as fast to draw
    drawn = Candidates(candidates, cloud.centres, cloud.spread, normals)
    return Search(scan_matching.match_and_touch, (query, felt.evidence, drawn, maps.arrays), cloud.stance.pose)


def sample_search(felt: MapInput, cloud: Cloud, candidates: int, maps: Maps, rng: np.random.Generator) -> Search:
    """Let every particle take one of its candidates, drawn by likelihood from its proposal, and have the whole of its
    map at its own pose.

    Args:
        felt: of the step.
        cloud: the proposals.
        candidates: K.
        maps: of the particles.
        rng: draws the candidates, and one of them.

    Returns:
        The search.
    """
    particles, joints = cloud.centres.shape
    count = candidates if felt.watched.any() else 1
    normals = rng.standard_normal((particles, count, joints))
    drawn = Candidates(count, cloud.stance.pose + cloud.centres, lower_factor(cloud.rest), normals)
    return Search(per_particle.advance, (felt, drawn, rng.random(particles), maps.arrays))


def match(search: Search | None, cloud: Cloud, poses: Array, number: int) -> tuple[Array, NDArray[np.bool_]]:
    """Match particles to their maps, and write into these what is felt there.

    Args:
        search: how; None: poses are the proposals.
        cloud: the proposals.
        poses: (N, J) rad, filled.
        number: of threads.

    Returns:
        The log of the mean likelihood (N,), and whether the match moved the pose (N,).
    """
    matched = Matched(poses, np.zeros(len(poses)), np.zeros(len(poses), dtype=bool))
    if search is None:
        np.add(cloud.stance.pose, cloud.centres, out=poses)
        return matched.log_likelihood, matched.moved
    threads.run(search.kernel, len(poses), number, *search.arguments, matched)
    if search.about is not None:
        poses += search.about
    return matched.log_likelihood, matched.moved


def sweep(felt: MapInput, stance: MeanFrames, maps: Maps, carve: bool) -> None:
    """Take note of what the hand came near, and carve the free space out of what all particles have in common.

    Args:
        felt: of the step.
        stance: of the mean pose.
        maps: of the particles.
        carve: False: each has carved its own.
    """
    if not carve:
        maps.seen |= maps.stale
        felt = felt._replace(reach=felt.reach._replace(carved=np.zeros(len(felt.watched))))
    free_space.sweep_free(felt, stance, maps.arrays)


MATCHING: dict[str, Callable[..., Search | None]] = {"mean": mean_search, "sample": sample_search}
