"""What matching asks of the maps at a step: points of the skin that are scored, and cells that touches may be due to.

Particles lie near the mean pose, so that points of the skin move with their poses in a straight line: geometry is done
once a step, here, at the mean. Shapes: J joints, L links, P patches, B bodies, V voxels, S points that are scored, C
cells that a touch may be due to, A joints that move the links in question. Metres and radians, world frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.compiled import inner, kernel, part
from haptic_env.moved import renamed
from haptic_env.patches import row_at
from observer.jacobians import _moved, _moving, twists
from observer.maps.capsules import any_of, owner, ringing
from observer.maps.free_space import capsule_voxels, from_point, most_voxels, room, triple

__getattr__ = renamed(__name__, {"Scan": "ScoredSkin", "Suspects": "TouchCauses"})


class ScoredSkin(NamedTuple):
    """Points of the skin that scan matching scores, patch by patch.

    Attributes:
        begin: those of the i-th are `begin[i]` up to `begin[i + 1]`.
        felt: whether it feels contact.
        place: (3, S) voxels, at the mean pose.
        gain: (A, 3, S) voxels per radian.
        active: (A,) joints.
    """

    begin: NDArray[np.int64]
    felt: NDArray[np.bool_]
    place: Array
    gain: Array
    active: NDArray[np.int64]


class TouchCauses(NamedTuple):
    """Cells that the touches may be due to, patch by patch.

    Attributes:
        begin: those of the i-th are `begin[i]` up to `begin[i + 1]`.
        weight: of its touch.
        fall: m, what a cell's part in it fades over.
        cell: (C,) index in the flat map.
        height: (C,) m above the skin at the mean pose.
        slope: (A, C) m per radian.
        active: (A,) joints.
    """

    begin: NDArray[np.int64]
    weight: Array
    fall: Array
    cell: NDArray[np.int64]
    height: Array
    slope: Array
    active: NDArray[np.int64]


class NearSkin(NamedTuple):
    """Cells about the skin of touched patches.

    Attributes:
        cell: (C,) index in the flat map.
        patch: (C,) the touched patch that is nearest.
        height: (C,) m above the skin.
    """

    cell: NDArray[np.int64]
    patch: NDArray[np.int64]
    height: Array


class Twist(NamedTuple):
    """What one radian a second of each joint does to the frame of a link, `linear` (J, 3) m/s and `angular` (J, 3)
    rad/s; `arm` and `other` (3,) are scratch."""

    linear: Array
    angular: Array
    arm: Array
    other: Array


@kernel()
def touched_room(felt, rings, margin):
    """Make room for the cells that all touches may be due to.

    Args:
        felt: of the step.
        rings: as of `ringing`.
        margin: m, as of `near_skin`.

    Returns:
        The `NearSkin`.
    """
    most = 0.0
    for link in range(len(rings)):
        if any_of(rings[link]):
            most += most_voxels(felt.body, felt.lattice, link, felt.reach.felt[link] + margin)
    count = int(most) + 1
    return NearSkin(np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64), np.empty(count))


@inner()
def near_skin(felt, frames, rings, margin, found, near):
    """Find the cells that touches may be due to.

    Args:
        felt: of the step.
        frames: where the bodies are, with `position` (B, 3) and `rotation` (B, 3, 3).
        rings: as of `ringing`.
        margin: m, by how much too high or too low a cell may lie at these frames.
        found: scratch, of `room`.
        near: is filled; of `touched_room`.

    Returns:
        How many there are.
    """
    body, lattice, count = felt.body, felt.lattice, 0
    for link in range(len(rings)):
        if not any_of(rings[link]):
            continue
        at, turn = triple(frames.position[felt.tree.link_body[link]]), frames.rotation[felt.tree.link_body[link]]
        length, radius = body.layout.length[link], body.radius[link]
        inner = max(radius - felt.evidence.deep - margin, 0.0) ** 2
        number = capsule_voxels(lattice, at, triple(turn[:, 2]), length, felt.reach.felt[link] + margin, found)
        for v in range(number):
            if found.square[v] < inner or not rings[link, row_at(body.layout, link, found.along[v])]:
                continue
            patch = owner(body, link, turn, from_point(lattice, found.cell[v], at))
            if patch >= 0 and felt.contacts[patch]:
                near.cell[count], near.patch[count] = found.cell[v], patch
                near.height[count] = np.sqrt(found.square[v]) - radius
                count += 1
    return count


@kernel()
def survey(felt, stance, solid, reach, margin):
    """Tell what matching asks of the maps, patch by patch.

    Of a silent patch only points beside a cell that is solid to any particle: silence speaks of what is known to be
    occupied alone. The pose of a particle is not the mean, so that touches may be due to cells that are too high or too
    low there.

    Args:
        felt: of the step.
        stance: at the mean pose.
        solid: (V,) the cells that any particle holds for occupied.
        reach: voxels, as far as cells are beside a point.
        margin: m, by how much too high or too low.

    Returns:
        The `ScoredSkin` of the patches of watched links, and the `TouchCauses` of all contacts.
    """
    body, contacts, watched = felt.body, felt.contacts, felt.watched
    rings, found = ringing(body, contacts), room(felt, margin)
    near = touched_room(felt, rings, margin)
    cells, most, touched = near_skin(felt, stance, rings, margin, found, near), 0, np.empty(len(rings), dtype=np.bool_)
    for link in range(len(rings)):
        touched[link] = any_of(rings[link])
    for patch in range(len(contacts)):
        if watched[body.patch_link[patch]]:
            most += body.begin[patch + 1] - body.begin[patch]
    moving, joints = _moving(felt.tree, watched), len(stance.pose)
    skin = ScoredSkin(
        np.zeros(len(contacts) + 1, dtype=np.int64),
        np.empty(len(contacts), dtype=np.bool_),
        np.empty((3, most)),
        np.empty((len(moving), 3, most)),
        moving,
    )
    moving = _moving(felt.tree, touched)
    causes = TouchCauses(
        np.zeros(len(contacts) + 1, dtype=np.int64),
        np.empty(len(contacts)),
        np.empty(len(contacts)),
        np.empty(cells, dtype=np.int64),
        np.empty(cells),
        np.empty((len(moving), cells)),
        moving,
    )
    twist = Twist(np.empty((joints, 3)), np.empty((joints, 3)), np.empty(3), np.empty(3))
    points = done = scored = touches = 0
    last = -1
    for patch in range(len(contacts)):
        link = body.patch_link[patch]
        if not watched[link] and not contacts[patch]:
            continue
        if link != last:
            own = felt.tree.link_body[link]
            twists(felt.tree, stance.pose, stance.position, stance.rotation, own, twist.linear, twist.angular)
            last = link
        if watched[link]:
            points = _add_points(felt, stance, patch, twist, solid, reach, skin, points)
            if points > skin.begin[scored]:
                skin.felt[scored] = contacts[patch]
                scored += 1
                skin.begin[scored] = points
        if contacts[patch]:
            done = _add_cells(felt, stance, patch, twist, near, causes, done)
            if done > causes.begin[touches]:
                causes.weight[touches], causes.fall[touches] = felt.touch[patch], felt.reach.fall[link]
                touches += 1
                causes.begin[touches] = done
    place, gain = np.empty((3, points)), np.empty((len(skin.active), 3, points))
    for i in range(3):
        for m in range(points):
            place[i, m] = skin.place[i, m]
        for a in range(len(skin.active)):
            for m in range(points):
                gain[a, i, m] = skin.gain[a, i, m]
    return (
        ScoredSkin(skin.begin[: scored + 1], skin.felt[:scored], place, gain, skin.active),
        TouchCauses(
            causes.begin[: touches + 1],
            causes.weight[:touches],
            causes.fall[:touches],
            causes.cell,
            causes.height,
            causes.slope,
            causes.active,
        ),
    )


@inner()
def _add_points(felt, stance, patch, twist, solid, reach, skin, count):
    """Add to the first `count` points of `skin` those of `patch`, whose link moves by `twist`; returns how many now."""
    body, lattice, (linear, angular, arm, near) = felt.body, felt.lattice, twist
    own, scale = felt.tree.link_body[body.patch_link[patch]], 1.0 / felt.lattice.resolution
    turn, at = stance.rotation[own], stance.position[own]
    points = body.points if felt.contacts[patch] else body.core
    for m in range(body.begin[patch], body.begin[patch + 1]):
        for i in range(3):
            arm[i] = turn[i, 0] * points[m, 0] + turn[i, 1] * points[m, 1] + turn[i, 2] * points[m, 2]
            near[i] = skin.place[i, count] = (at[i] + arm[i] - lattice.origin[i]) * scale
        if not felt.contacts[patch] and not _beside(solid, lattice.shape, near, reach):
            continue
        for a in range(len(skin.active)):
            moved = _moved(linear[skin.active[a]], angular[skin.active[a]], arm)
            for i in range(3):
                skin.gain[a, i, count] = moved[i] * scale
        count += 1
    return count


@inner()
def _add_cells(felt, stance, patch, twist, near, causes, count):
    """Add to the first `count` cells of `causes` those of `near` that `patch` may touch; returns how many now."""
    body, (linear, angular, arm, normal), link = felt.body, twist, felt.body.patch_link[patch]
    own = felt.tree.link_body[link]
    turn, at = stance.rotation[own], stance.position[own]
    for c in range(len(causes.cell)):
        if near.patch[c] != patch:
            continue
        causes.cell[count], causes.height[count] = near.cell[c], near.height[c]
        arm[0], arm[1], arm[2] = from_point(felt.lattice, near.cell[c], at)
        along = 0.0
        for i in range(3):
            along += arm[i] * turn[i, 2]
        along = min(max(along, 0.0), body.layout.length[link])
        for i in range(3):
            normal[i] = (arm[i] - along * turn[i, 2]) / (near.height[c] + body.radius[link] + 1e-9)
        for a in range(len(causes.active)):
            moved = _moved(linear[causes.active[a]], angular[causes.active[a]], arm)
            causes.slope[a, count] = -(normal[0] * moved[0] + normal[1] * moved[1] + normal[2] * moved[2])
        count += 1
    return count


@part()
def _beside(solid, shape, place, reach):
    """Whether any marked cell is at most `reach` voxels from that of `place` (3,) voxels along each axis."""
    x, y, z = int(np.floor(place[0])), int(np.floor(place[1])), int(np.floor(place[2]))
    for i in range(max(x - reach, 0), min(x + reach + 1, shape[0])):
        for j in range(max(y - reach, 0), min(y + reach + 1, shape[1])):
            row = (i * shape[1] + j) * shape[2]
            for k in range(max(z - reach, 0), min(z + reach + 1, shape[2])):
                if solid[row + k]:
                    return True
    return False
