"""The hand as capsules in a grid: the arrays of one step that compiled code reads.

L links, P patches, M points of the skin, B bodies, J joints, (X, Y, Z) voxels. Metres and radians, world frame.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part
from haptic_env.grid import Grid
from haptic_env.moved import renamed
from haptic_env.patches import Patches, PatchLayout, patch_at
from observer.jacobians import place_spread
from observer.kinematics import Tree, body_frames
from observer.maps.contact_model import Evidence, LinkEvidence, reach_of

__getattr__ = renamed(__name__, {"Stance": "MeanFrames", "Reach": "LinkEvidence"})


class Body(NamedTuple):
    """The hand as capsules with patches.

    Attributes:
        radius: (L,) m.
        layout: of its patches; it has the length (L,) m of the bones.
        points: (M, 3) m just outside the skin, in their link's frame, sorted by patch.
        core: (M, 3) m, the same moved beneath the skin.
        begin: (P + 1,) the points of patch p are `begin[p]` up to `begin[p + 1]`.
        patch_link: (P,) index.
    """

    radius: Array
    layout: PatchLayout
    points: Array
    core: Array
    begin: NDArray[np.int64]
    patch_link: NDArray[np.int64]


class Lattice(NamedTuple):
    """A grid.

    Attributes:
        origin: (3,) m.
        resolution: m.
        shape: (3,).
    """

    origin: Array
    resolution: float
    shape: NDArray[np.int64]


class BodyFrames(NamedTuple):
    """Where the bodies of a hand are.

    Attributes:
        position: (B, 3) m.
        rotation: (B, 3, 3).
    """

    position: Array
    rotation: Array


class MeanFrames(NamedTuple):
    """How the hand stands.

    Attributes:
        pose: (J,) rad.
        position: (B, 3) m, of its bodies.
        rotation: (B, 3, 3).
    """

    pose: Array
    position: Array
    rotation: Array


class MapInput(NamedTuple):
    """What one step has to say to the maps.

    Attributes:
        tree: the hand's kinematics, where its root is.
        body: its capsules and patches.
        lattice: the grid.
        evidence: the contact model.
        reach: what each link says of the cells about it.
        contacts: (P,).
        touch: (P,) weight of each patch's touch.
        watched: (L,) the links whose patches have a say in the pose.
    """

    tree: Tree
    body: Body
    lattice: Lattice
    evidence: Evidence
    reach: LinkEvidence
    contacts: NDArray[np.bool_]
    touch: Array
    watched: NDArray[np.bool_]


@lru_cache(maxsize=8)
def body_of(patches: Patches, resolution: float) -> Body:
    """Make the arrays of a hand.

    Args:
        patches: of the hand.
        resolution: m, edge of a voxel; points of the skin lie about two voxels apart.

    Returns:
        The arrays, the same ones for the same arguments.
    """
    skin = patches.surface(2.0 * resolution)
    order = np.argsort(skin.patch, kind="stable")
    lift = 0.5 * resolution * skin.normals
    return Body(
        radius=np.array([link.radius for link in patches.links]),
        layout=patches.layout,
        points=(skin.points + lift)[order],
        core=(skin.points - lift)[order],
        begin=np.searchsorted(skin.patch[order], np.arange(len(patches) + 1)).astype(np.int64),
        patch_link=patches.link.astype(np.int64),
    )


def lattice_of(grid: Grid) -> Lattice:
    """Make the arrays of a grid.

    Args:
        grid: any.

    Returns:
        The arrays.
    """
    return Lattice(np.array(grid.origin), grid.resolution, np.array(grid.shape))


@part()
def voxel_of(lattice, x, y, z):
    """Find the voxel that holds a point, as `Grid.index` does.

    Args:
        lattice: the grid.
        x: m.
        y: m.
        z: m.

    Returns:
        Its three indices, and whether the grid has it.
    """
    res, origin, shape = lattice.resolution, lattice.origin, lattice.shape
    i = int(np.floor((x - origin[0]) / res))
    j = int(np.floor((y - origin[1]) / res))
    k = int(np.floor((z - origin[2]) / res))
    return i, j, k, 0 <= i < shape[0] and 0 <= j < shape[1] and 0 <= k < shape[2]


@part()
def owner(body, link, turn, way):
    """Find the patch nearest to a point.

    Args:
        body: the hand.
        link: index of the link that has the patch.
        turn: (3, 3), the frame of the link.
        way: three numbers, m, to the point from where the link begins.

    Returns:
        The patch; -1 where nothing is felt.
    """
    x = turn[0, 0] * way[0] + turn[1, 0] * way[1] + turn[2, 0] * way[2]
    y = turn[0, 1] * way[0] + turn[1, 1] * way[1] + turn[2, 1] * way[2]
    z = turn[0, 2] * way[0] + turn[1, 2] * way[1] + turn[2, 2] * way[2]
    return patch_at(body.layout, link, x, y, z)


@kernel()
def ringing(body, contacts):
    """Find the rows of patches that feel anything.

    Args:
        body: the hand.
        contacts: (P,).

    Returns:
        (L, along + 1): whether any patch in a row of a link, or on its tip, feels contact.
    """
    layout = body.layout
    rings = np.zeros((len(body.radius), layout.along + 1), dtype=np.bool_)
    for patch in range(len(contacts)):
        if contacts[patch]:
            for row in range(layout.rows[patch, 0], layout.rows[patch, 1] + 1):
                rings[body.patch_link[patch], row] = True
    return rings


@inner()
def any_of(flags):
    """Tell whether any flag is set.

    Args:
        flags: (M,).

    Returns:
        Whether.
    """
    for flag in flags:  # noqa: SIM110 - compiled
        if flag:
            return True
    return False


@kernel()
def stand(tree, body, evidence, caution, pose, covariance):
    """Put the hand where it is on average.

    Args:
        tree: its kinematics.
        body: its capsules.
        evidence: the contact model.
        caution: times as far as `covariance` says do maps allow for links to be elsewhere.
        pose: (J,) rad, the mean.
        covariance: (J, J) rad².

    Returns:
        The `MeanFrames`, and the `LinkEvidence`.
    """
    position = np.empty((len(tree.parent), 3))
    rotation = np.empty((len(tree.parent), 3, 3))
    body_frames(tree, pose, position, rotation)
    place = place_spread(tree, body.layout.length, pose, covariance, position, rotation)
    for link in range(len(place)):
        place[link] *= caution
    return MeanFrames(pose, position, rotation), reach_of(body, evidence, place)
