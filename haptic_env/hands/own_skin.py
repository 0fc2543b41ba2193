"""The skin of a hand of one's own: which capsules its bodies are, where they end, and its taxels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.hands import description
from haptic_env.hands.description import Finger
from haptic_env.hands.fitting import GEOM, NAMES, ROUND, FittedCapsule, capsules_of, geom_name, misfit, surface
from haptic_env.hands.own_joints import OwnJoint
from haptic_env.hands.own_model import OwnModel
from haptic_env.hands.skeleton import Bone
from haptic_env.patches import Link
from haptic_env.taxels import Taxel

MOST_CAPSULES = 200


class Fit(NamedTuple):
    """What stands for a geom.

    Attributes:
        link: the first of the hand's links that do.
        geom: which it is.
        kind: of the geom.
        capsules: how many links.
        out: m, how far they stand out of it at most.
        bare: m, how far it stands out of them at most.
        outline: (M, 3) m of its surface, where the hand is at rest: in the frame of the root, and of `OwnHand` in the
            world.
    """

    link: str
    geom: str
    kind: str
    capsules: int
    out: float
    bare: float
    outline: Array


class OwnSkin(NamedTuple):
    """The skin of a hand.

    Attributes:
        bones: the capsules.
        fits: of geoms that are none themselves.
        notes: which bodies are without skin.
    """

    bones: list[Bone]
    fits: list[Fit]
    notes: list[str]


def skin_of(own: OwnModel, joints: Mapping[str, OwnJoint], centre: Array) -> OwnSkin:
    """Find the capsules of a hand. Their palmar sides face the grasp centre where the hand is at rest.

    Args:
        own: the model of the hand.
        joints: by their names.
        centre: (3,) m, the grasp centre, in the frame of the root.

    Returns:
        The skin.

    Raises:
        ValueError: for geoms that there are not, or that are no solids, and bodies without any.
    """
    model, data = own.model, mujoco.MjData(own.model)
    for joint in joints.values():
        data.qpos[model.jnt_qposadr[joint.number]] = joint.rest * (joint.arm or 1.0)
    mujoco.mj_kinematics(model, data)
    root, axes = _frame(data, own.root)
    seen = root + axes @ centre
    bones: list[Bone] = []
    fits: list[Fit] = []
    for finger in own.told.fingers:
        known = [model.geom(g).name for body in finger.bodies for g in _every_geom(own, own.bodies[body])]
        for geom in finger.geoms:
            validate.choice(f"geom of {finger.title}", geom, [name for name in known if name])
        for body in finger.bodies:
            capsules, found = _capsules(own, body, finger)
            at, turn = _frame(data, own.bodies[body])
            fits += [fit._replace(outline=(at + fit.outline @ turn.T - root) @ axes) for fit in found]
            anchor = _anchor(own, own.bodies[body])
            ends = [_ordered(anchor, each) for each in capsules]
            far = int(np.argmax([np.linalg.norm(end - anchor) for _, end in ends]))
            for k, ((start, end), each) in enumerate(zip(ends, capsules, strict=True)):
                name = body if len(capsules) == 1 else f"{body}_{k + 1}"
                palmar = turn.T @ (seen - at) - 0.5 * (start + end)
                tip = finger.tip and body == finger.bodies[-1] and k == far
                bones.append(Bone(name, body, start, end, each.radius, palmar, tip))
    names = [bone.name for bone in bones]
    if len(names) > MOST_CAPSULES:
        raise ValueError(f"its skin is {len(names)} capsules; at most {MOST_CAPSULES} are valid: name fewer geoms")
    if len({*names}) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"two links would be named {twice!r}; rename a body of the model")
    bare = [b for b in (own.root, *own.below) if _geoms(own, b) and own.name(b) not in {bone.body for bone in bones}]
    told = validate.listed(own.name(b) for b in bare)
    return OwnSkin(bones, fits, [f"of no finger, so without skin: {told}"] if bare else [])


def taxels_of(own: OwnModel, hand: Hand, bones: Sequence[Bone]) -> list[Taxel]:
    """Place the taxels of a hand, each on the link of its body that it lies on.

    Args:
        own: the model of the hand.
        hand: that was made of it.
        bones: of its skin.

    Returns:
        The taxels in the frames of their links.
    """
    body_of = {bone.name: bone.body for bone in bones}
    here, there = mujoco.MjData(own.model), mujoco.MjData(hand.model)
    here.qpos[:] = 0.0
    mujoco.mj_kinematics(own.model, here)
    mujoco.mj_kinematics(hand.model, there)  # all joints at zero in both
    root, base = _frame(here, own.root), _frame(there, hand.model.body(own.name(own.root)).id)
    across = base[1] @ root[1].T
    found = []
    for told in own.told.taxels or ():
        at, turn = _frame(here, own.bodies[told.body])
        turn = across @ turn
        place = base[0] + across @ (at - root[0]) + turn @ told.position
        mine = [index for index, link in enumerate(hand.links) if body_of[link.name] == told.body]
        frames = [_frame(there, hand.link_bodies[index]) for index in mine]
        local = [(axes.T @ (place - start), axes.T @ turn @ told.normal) for start, axes in frames]
        best = int(np.argmin([_off(hand.links[index], *each) for index, each in zip(mine, local, strict=True)]))
        found.append(Taxel(told.name, mine[best], *local[best], told.radius))
    return found


def _frame(data: Any, body: int) -> tuple[Array, Array]:
    return data.xpos[body], data.xmat[body].reshape(3, 3)


def _off(link: Link, place: Array, facing: Array) -> float:
    """How badly a taxel fits a link: m off its surface, and 1 cm more where it faces inward."""
    away = place - np.array([0.0, 0.0, np.clip(place[2], 0.0, link.length)])
    return abs(float(np.linalg.norm(away)) - link.radius) + 0.01 * (float(away @ facing) < 0.0)


def _every_geom(own: OwnModel, body: int) -> list[int]:
    return [int(g) for g in np.flatnonzero(own.model.geom_bodyid == body)]


def _geoms(own: OwnModel, body: int) -> list[int]:
    """The geoms of a body that collide; all of them where none does."""
    mine = _every_geom(own, body)
    return [g for g in mine if own.model.geom_contype[g] or own.model.geom_conaffinity[g]] or mine


def _capsules(own: OwnModel, body: str, finger: Finger) -> tuple[list[FittedCapsule], list[Fit]]:
    """The capsules of a body, and of which geoms they are that are none."""
    told = [FittedCapsule(each.start, each.end, each.radius) for each in own.told.capsules if each.body == body]
    if told:
        if min(float(np.linalg.norm(each.end - each.start)) for each in told) < 1e-4:
            raise ValueError(f"a capsule of body {body!r} has no length: start and end must be 0.1 mm apart")
        return told, []
    geoms = _geoms(own, own.bodies[body])
    if finger.geoms:
        geoms = [g for g in _every_geom(own, own.bodies[body]) if own.model.geom(g).name in finger.geoms]
    if not geoms:
        told_so = "geom of those that are named" if finger.geoms else "geom"
        raise ValueError(f"body {body!r} has no {told_so} to be skin; give it a [[capsule]], or leave it out of bodies")
    found: list[FittedCapsule] = []
    fits = []
    for geom in geoms:
        capsules, which = capsules_of(own.model, geom), geom_name(own.model, geom)
        for each in capsules:
            if not description.THINNEST <= each.radius <= description.THICKEST:
                raise ValueError(
                    f"geom {which} would be a capsule of radius {each.radius:g} m; valid are "
                    f"{description.THINNEST:g} to {description.THICKEST:g} m: are the model's lengths in metres?"
                )
        kind = GEOM(own.model.geom_type[geom])
        if kind not in ROUND:
            named = body if len(geoms) == len(capsules) == 1 else f"{body}_{len(found) + 1}"
            out, bare = misfit(own.model, geom, capsules)
            fits.append(Fit(named, which, NAMES[kind], len(capsules), out, bare, surface(own.model, geom)))
        found += capsules
    return found, fits


def _anchor(own: OwnModel, body: int) -> Array:
    """(3,) m in the frame of a body, from where it reaches: the place of its first joint."""
    if not own.model.body_jntnum[body]:
        return np.zeros(3)
    return np.asarray(own.model.jnt_pos[own.model.body_jntadr[body]])


def _ordered(anchor: Array, capsule: FittedCapsule) -> tuple[Array, Array]:
    """The ends of a capsule, the one nearer to its joint, at `anchor`, first."""
    near, far = sorted(capsule[:2], key=lambda end: float(np.linalg.norm(end - anchor)))
    return near, far
