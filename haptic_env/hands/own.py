"""Hands of one's own: a model and a TOML file that describes it (`haptic_env.hands.description`) made into a `Hand`.

The skin is capsules (`haptic_env.hands.fitting`), of which the hand's mass is made too. Each joint below the root has a
motor of its own, unless it follows another (`haptic_env.hands.own_couplings`); actuators and other tendons of the model
are left out, and `OwnHand.notes` say so.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from haptic_env import validate
from haptic_env.hand import Hand
from haptic_env.hands import description
from haptic_env.hands import wrist as wrists
from haptic_env.hands.description import HandDescription
from haptic_env.hands.drives import Drive
from haptic_env.hands.own_couplings import OwnCouplings, at_rest, couplings_of, tied
from haptic_env.hands.own_joints import OwnJoint, drives_of, joints_of
from haptic_env.hands.own_model import OwnModel
from haptic_env.hands.own_skin import Fit, OwnSkin, skin_of, taxels_of
from haptic_env.hands.skeleton import hand_of, quaternion_of
from haptic_env.pose import Pose
from haptic_env.taxels import TaxelPatches

LARGEST = 2.0  # m, of a hand: larger ones are not in metres
ANY_DRIVE = Drive(1.0, 1.0, 0.0, 0.0)  # of a hand whose inertia is to be known


@dataclass(frozen=True)
class OwnHand:
    """A hand of one's own, and what is to be known of how it was made.

    Attributes:
        hand: the hand.
        fits: of the geoms that are no capsules.
        notes: what of the model was left out or taken as usual, a line each.
    """

    hand: Hand
    fits: tuple[Fit, ...]
    notes: tuple[str, ...]


def make(
    path: str | Path, patches_along: int | None = None, patches_around: int | None = None, wrist: str = "fixed"
) -> Hand:
    """Build the hand that a TOML file describes.

    Args:
        path: of the file.
        patches_along: bins along each capsule, 1 to 100; None: as the file says.
        patches_around: sectors around each, 1 to 100; None: as the file says.
        wrist: "fixed", or "free": the hand moves as a whole (`haptic_env.hands.wrist`), six joints more, the first
            ones.

    Returns:
        The hand.

    Raises:
        ValueError: for what is wrong with the file or its model, in one line that names the file.
    """
    return read(path, patches_along, patches_around, wrist).hand


def read(
    path: str | Path, patches_along: int | None = None, patches_around: int | None = None, wrist: str = "fixed"
) -> OwnHand:
    """Build the hand that a TOML file describes, and tell how.

    Args:
        path: of the file.
        patches_along: as `make`'s.
        patches_around: as `make`'s.
        wrist: as `make`'s.

    Returns:
        The hand, and what is to be known of it.

    Raises:
        ValueError: as `make`.
    """
    told = description.read(path)
    free = validate.choice("wrist", wrist, wrists.WRISTS) == "free"
    if told.taxels is not None and (patches_along, patches_around) != (None, None):
        raise ValueError(f"{path}: its patches are a list, [[taxel]]: patches_along and patches_around say nothing")
    if patches_along is not None:
        told = replace(told, along=validate.integer("patches_along", patches_along, 1, 100))
    if patches_around is not None:
        told = replace(told, around=validate.integer("patches_around", patches_around, 1, 100))
    try:
        found = _made(told, free)
        return replace(found, hand=replace(found.hand, source=str(path)))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _made(told: HandDescription, free: bool) -> OwnHand:
    own = OwnModel(told)
    notes, joints = own.left_out(), joints_of(own)
    coupled = couplings_of(own, joints)
    joints = at_rest(joints, coupled.couplings)
    place = _place(own)
    centre = np.zeros(3) if told.grasp_centre is None else told.grasp_centre
    skin = skin_of(own, joints, place.rotation.T @ (centre - place.position))
    # The drives follow from the inertia, which is known once there is a hand.
    draft = _hand(own, joints, coupled, dict.fromkeys(joints, ANY_DRIVE), skin, place, free=False)
    notes += (
        coupled.notes + [joint.note for joint in joints.values() if joint.note] + skin.notes + _checked(draft, told)
    )
    hand = _hand(own, joints, coupled, drives_of(draft, joints), skin, place, free)
    if told.taxels is not None:
        hand = replace(hand, patches=TaxelPatches(hand.links, taxels_of(own, hand, skin.bones)))
    fits = (fit._replace(outline=place.position + fit.outline @ place.rotation.T) for fit in skin.fits)
    return OwnHand(hand, tuple(fits), tuple(notes))


def _place(own: OwnModel) -> Pose:
    """Where the root is in the world: as the file says, or the model with all joints at zero."""
    data = mujoco.MjData(own.model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(own.model, data)
    position = data.xpos[own.root] if own.told.position is None else own.told.position
    quaternion = data.xquat[own.root] if own.told.quaternion is None else own.told.quaternion
    return Pose.of(position.copy(), quaternion / np.linalg.norm(quaternion))


def _hand(
    own: OwnModel,
    joints: dict[str, OwnJoint],
    coupled: OwnCouplings,
    drives: dict[str, Drive],
    skin: OwnSkin,
    place: Pose,
    free: bool,
) -> Hand:
    told = own.told
    hand = hand_of(
        own.model,
        told.name,
        root=own.name(own.root),
        joints={name: (drives[name], float(np.rad2deg(each.rest))) for name, each in joints.items()},
        bones=skin.bones,
        position=place.position,
        quaternion=quaternion_of(place.rotation),
        grasp_centre=np.zeros(3) if told.grasp_centre is None else told.grasp_centre,
        workspace=told.workspace,
        opening=told.opening,
        wrist=(place.position if told.wrist_centre is None else told.wrist_centre) if free else None,
        patches_along=told.along,
        patches_around=told.around,
        ranges={name: each.limits for name, each in joints.items()},
        lever_arms={name: each.arm for name, each in joints.items()},
    )
    return tied(hand, list(joints), coupled)


def _checked(hand: Hand, told: HandDescription) -> list[str]:
    """What is to be known of a hand; `ValueError` for one that cannot explore."""
    if not hand.moves.any():
        raise ValueError(
            f"no joint moves its skin: joints {validate.listed(hand.joint_names)} are on other bodies than those of "
            "fingers and palm"
        )
    ends = hand.link_ends(hand.at_rest())
    size = float(np.ptp(ends, axis=0).max())
    if size > LARGEST:
        raise ValueError(
            f"it is {size:.3g} m large, and hands are of {LARGEST:g} m at most: are its lengths in metres?"
        )
    if told.grasp_centre is None:
        tips = [index for index, link in enumerate(hand.links) if link.tip] or list(range(len(hand.links)))
        middle = ", ".join(f"{each:.3f}" for each in ends[tips].mean(axis=0))
        raise ValueError(
            f"it has no grasp_centre, where objects lie, (3,) m in the world; the middle of its fingertips at rest is "
            f"[{middle}]"
        )
    still = [hand.joint_names[joint] for joint in np.flatnonzero(~np.any(hand.moves, axis=0))]
    return [f"joints that move no skin: {validate.listed(still)}"] if still else []
