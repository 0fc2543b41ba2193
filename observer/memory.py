"""What observers need of the memory, counted before any of it is taken.

Shapes: J joints, N particles, K candidates, V voxels, H hypotheses.
"""

from __future__ import annotations

import numpy as np

from haptic_env.grid import Grid
from haptic_env.hand import Hand
from observer.maps.occupancy import FIRST_SLOTS

MEMORY = 4 * 2**30  # bytes that an observer may need
GIB = 2**30


def check(told: str, needed: float) -> None:
    """Check that something fits into the memory.

    Args:
        told: what it is.
        needed: bytes.

    Raises:
        ValueError: for more than `MEMORY`.
    """
    if needed > MEMORY:
        raise ValueError(
            f"{told} would need {needed / GIB:.3g} GiB of memory, more than the {MEMORY / GIB:g} GiB that an observer "
            "may take"
        )


def of_poses(joints: int, lag: int, kinematic: bool = False) -> float:
    """Count what a Gaussian over the angles of several steps takes, and what is made of it at a step.

    Args:
        joints: J.
        lag: steps.
        kinematic: whether joints are followed in pairs.

    Returns:
        Bytes.
    """
    size = (lag + 3) * joints
    return 8.0 * (3 * size**2 + (10 * joints**2 * (lag + 3) ** 2 if kinematic else 0))


def of_hypotheses(joints: int, hypotheses: float, samples: float) -> float:
    """Count what hypotheses of an object take.

    Args:
        joints: J.
        hypotheses: H.
        samples: of the pose, for which each has weights, part by part.

    Returns:
        Bytes.
    """
    return 8.0 * (32.0 * hypotheses + samples * (4.0 * joints + 2.0 * joints * hypotheses))


def of_maps(hand: Hand, grid: Grid, particles: int, candidates: int, slots: int) -> float:
    """Count what the maps of particles take, and what is made of them at a step.

    Args:
        hand: whose links have voxels about them.
        grid: of the maps.
        particles: N.
        candidates: K of each particle.
        slots: voxels that each keeps of its own.

    Returns:
        Bytes.
    """
    voxels = float(np.prod(grid.shape))
    radius = np.array([link.radius for link in hand.links]) + 2.0 * grid.resolution
    length = np.array([link.length for link in hand.links])
    about = np.minimum(voxels, np.pi * radius**2 * (length + 4.0 / 3.0 * radius) / grid.resolution**3).sum()
    return 32.0 * (voxels + about) + particles * (slots + 8.0 * hand.joints * (candidates + 4))


def of_particles(
    hand: Hand, grid: Grid, particles: int, candidates: int, lag: int, dense: bool, kinematic: bool
) -> None:
    """Check that a particle filter fits into the memory.

    Args:
        hand: with J joints.
        grid: of the maps.
        particles: N.
        candidates: K of each particle.
        lag: steps.
        dense: whether a map has its own of every voxel.
        kinematic: whether joints are followed in pairs.

    Raises:
        ValueError: for more than `MEMORY`.
    """
    voxels = int(np.prod(grid.shape))
    check(
        f"particles={particles}, candidates={candidates}, lag={lag} and {voxels} voxels",
        of_maps(hand, grid, particles, candidates, voxels if dense else FIRST_SLOTS)
        + of_poses(hand.joints, lag + 1, kinematic),
    )
