"""What an observer is told, checked at its edge: what comes further is inside the arrays of its kernels.

Shapes: J joints, P patches.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.compiled import GIVEN, inner
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.moved import renamed
from haptic_env.pose import Pose
from haptic_env.sensors import FeltAngles
from haptic_env.shapes import Solid
from observer.belief import Belief, Transition
from observer.pose.seen import LaggedPose

__getattr__ = renamed(__name__, {"Told": "SensedStep"})

WIDEST = float(np.float32(FeltAngles.BOUND))  # rad: what an environment's observation space allows
LARGEST_ANGLE, LARGEST_VARIANCE = 1e3, 1e6  # rad and rad²: a pose that is believed is known better
PLAIN = [tuple(map(np.dtype, ("f8", angles, contacts))) for angles in ("f4", "f8") for contacts in ("i1", "?")]
ANGLES, SQUARE = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")  # as observers make them
WORLD: dict[str, tuple[type, str]] = {
    "hand": (Hand, "a haptic_env.hand.Hand, such as env.unwrapped.hand"),
    "grid": (Grid, "a haptic_env.grid.Grid"),
    "solid": (Solid, "a Solid, as haptic_env.shapes.make gives"),
}
COUNT = 10**12  # of anything: far more than fits into the memory


class SensedStep(NamedTuple):
    """One turn.

    Attributes:
        torque: (J,) commanded, fractions.
        joint_angles: (J,) rad, felt.
        contacts: (P,) felt; False where that was not measured.
        unmeasured: (P,) patches whose contact was not measured; None: all were.
    """

    torque: Array
    joint_angles: Array
    contacts: NDArray[np.bool_]
    unmeasured: NDArray[np.bool_] | None = None


class Followed(NamedTuple):
    """What a belief says of the lagged pose.

    Attributes:
        transition: how it moved, or the pose alone.
        covariance: (J, J) rad².
        contacts: (P,) felt at it.
        root: where the hand as a whole was.
        unmeasured: (P,) patches whose contact was not measured; None: all were.
    """

    transition: Transition | LaggedPose
    covariance: Array
    contacts: NDArray[np.bool_]
    root: Pose | None
    unmeasured: NDArray[np.bool_] | None = None


def told(
    hand: Hand, torque: ArrayLike | None, joint_angles: ArrayLike, contacts: ArrayLike, needs_torque: bool = True
) -> SensedStep:
    """Check what an observer is told at a step.

    Args:
        hand: with J joints and P patches.
        torque: (J,) fractions; None, where none is needed: it is not known.
        joint_angles: (J,) rad; NaN where a joint was not measured.
        contacts: (P,); NaN where a patch was not measured.
        needs_torque: whether the motion asks what was commanded.

    Returns:
        The same as arrays; of torques that are not known zeros.

    Raises:
        ValueError: that names the joint, for a torque beyond ± 1 of its limit, an angle beyond ± 4π rad, and what is
            not finite, NaN of angles apart; and for contacts that are not 0, 1 or NaN.
    """
    if (plain := _plainly(hand, torque, joint_angles, contacts)) is not None:
        return plain
    commanded: Any = np.zeros(hand.joints) if torque is None and not needs_torque else torque
    u = validate.array("torque", commanded, (hand.joints,), bound=1.0, names=hand.joint_names)
    if (missing := _missing(joint_angles, hand.joints)) is None:
        q = angles(hand, joint_angles)
    else:
        q = angles(hand, np.where(missing, 0.0, joint_angles))
        q = np.where(missing, np.nan, q)
    if (missing := _missing(contacts, len(hand.patches))) is None:
        return SensedStep(u, q, validate.binary("contacts", contacts, (len(hand.patches),)))
    z = validate.binary("contacts", np.where(missing, 0.0, contacts), (len(hand.patches),))
    return SensedStep(u, q, z, missing)


def _plainly(hand: Hand, torque: Any, joint_angles: Any, contacts: Any) -> SensedStep | None:
    """What an environment tells at most steps, checked in one call; None: it has to be looked at more closely."""
    if not type(torque) is type(joint_angles) is type(contacts) is np.ndarray:
        return None
    shapes = torque.shape == joint_angles.shape == (hand.joints,) and contacts.shape == (len(hand.patches),)
    if not (shapes and (torque.dtype, joint_angles.dtype, contacts.dtype) in PLAIN):
        return None
    q, felt = joint_angles.astype(np.float64, copy=False), contacts.view(np.uint8)
    return SensedStep(torque, q, felt.astype(np.bool_)) if _plain(torque, q, felt, WIDEST) else None


@inner(types.boolean(GIVEN, GIVEN, types.Array(types.uint8, 1, "A", readonly=True, aligned=False), types.float64))
def _plain(torque: Array, angles: Array, contacts: NDArray[np.uint8], widest: float) -> bool:
    plain = True  # torques are fractions, no angle is beyond ± `widest`, and contacts are 0 or 1
    for j in range(len(torque)):
        plain &= abs(torque[j]) <= 1.0 and abs(angles[j]) <= widest
    for patch in range(len(contacts)):
        plain &= contacts[patch] <= 1
    return plain


def _missing(given: ArrayLike, count: int) -> NDArray[np.bool_] | None:
    """Which of `count` real numbers are NaN; None: none are, or they are no such numbers."""
    if type(given) is not np.ndarray and not isinstance(given, list | tuple):
        return None
    numbers = validate.real(given)
    if numbers is None or numbers.dtype.kind != "f" or numbers.shape != (count,):
        return None
    missing = np.isnan(numbers)
    return missing if missing.any() else None


def angles(hand: Hand, joint_angles: ArrayLike) -> Array:
    """Check felt angles.

    Args:
        hand: with J joints.
        joint_angles: (J,) rad.

    Returns:
        The same as an array.

    Raises:
        ValueError: as `told`.
    """
    return validate.array("joint_angles", joint_angles, (hand.joints,), "radians", bound=WIDEST, names=hand.joint_names)


def root(given: Pose | None) -> Pose | None:
    """Check where a hand as a whole is.

    Args:
        given: its pose; None: it does not move.

    Returns:
        A copy of the pose, or None.

    Raises:
        ValueError: for what is none.
    """
    if given is None:
        return None
    validate.instance("root", given, Pose, "a haptic_env.pose.Pose, or None for a hand that does not move as a whole")
    return given.checked("root")


def world(**given: object) -> None:
    """Check that things are what they are called.

    Args:
        **given: a `hand`, a `grid` or a `solid`.

    Raises:
        ValueError: for one that is none.
    """
    for what, value in given.items():
        validate.instance(what, value, *WORLD[what])


def belief(hand: Hand, given: Belief) -> Followed:
    """Check what a belief with a transition says of a hand.

    Args:
        hand: with J joints and P patches.
        given: the belief.

    Returns:
        What it says, as arrays like an observer's own, whatever was put in their place.

    Raises:
        ValueError: for the belief of another hand, and for one whose pose, or how it moved, is not finite or beyond all
            angles.
    """
    validate.instance("transition of belief", given.transition, Transition, "a Transition")
    if _as_made(hand, given):
        now, covariance, contacts = given.transition, given.lagged_covariance, given.lagged_contacts
        at, missing = root(given.lagged_root), _unmeasured(hand, given)
        return Followed(now, covariance, contacts, at, missing)  # type: ignore[arg-type]
    felt = validate.binary("lagged_contacts of belief", given.lagged_contacts)  # type: ignore[arg-type]
    pose = validate.numbers("lagged_joint_angles of belief", given.lagged_joint_angles)
    told, mine = (pose.size, felt.size), (hand.joints, len(hand.patches))
    if told != mine:
        raise ValueError(
            f"belief must be of hand {hand.name!r}, with {mine[0]} joints and {mine[1]} patches, got one of a hand "
            f"with {told[0]} and {told[1]}"
        )
    contacts = validate.binary("lagged_contacts of belief", felt, mine[1:])
    flat, square = (hand.joints,), (hand.joints, hand.joints)
    covariance = validate.array(
        "lagged_covariance of belief", given.lagged_covariance, square, "rad²", bound=LARGEST_VARIANCE
    )
    moved = [
        _own(validate.array(f"{name} of belief's transition", getattr(given.transition, name), shape, bound=bound))
        for name, shape, bound in (
            ("mean", flat, LARGEST_ANGLE),
            ("follow", square, validate.LARGEST),
            ("before", flat, LARGEST_ANGLE),
            ("rest", square, LARGEST_VARIANCE),
        )
    ]
    at, missing = root(given.lagged_root), _unmeasured(hand, given)
    return Followed(Transition(*moved), _own(covariance), contacts, at, missing)


def _unmeasured(hand: Hand, given: Belief) -> NDArray[np.bool_] | None:
    """(P,) the patches of which a belief says that their contact was not measured; None: all were."""
    if given.lagged_unmeasured is None:
        return None
    return validate.binary("lagged_unmeasured of belief", given.lagged_unmeasured, (len(hand.patches),))


def _as_made(hand: Hand, given: Belief) -> bool:
    """Whether `given` is in all that `belief` checks like what an observer makes: most are, and asked at each step."""
    flat, square, felt = (hand.joints,), (hand.joints, hand.joints), given.lagged_contacts
    moved = given.transition
    assert moved is not None
    arrays = (*moved, given.lagged_covariance, given.lagged_joint_angles)
    for each, shape in zip(arrays, (flat, square, flat, square, square, flat), strict=True):
        if type(each) is not np.ndarray or each.dtype != np.float64 or each.shape != shape or not each.flags.carray:
            return False
    if type(felt) is not np.ndarray or felt.dtype != np.bool_ or felt.shape != (len(hand.patches),):
        return False
    return _believable(*arrays)


@inner(types.boolean(ANGLES, SQUARE, ANGLES, SQUARE, SQUARE, ANGLES))
def _believable(mean: Array, follow: Array, before: Array, rest: Array, covariance: Array, pose: Array) -> bool:
    """Whether all is finite and no angle or variance is beyond its largest."""
    inside = True
    for i in range(len(mean)):
        inside &= abs(mean[i]) <= LARGEST_ANGLE
        inside &= abs(before[i]) <= LARGEST_ANGLE
        inside &= abs(pose[i]) <= validate.LARGEST
        for j in range(len(mean)):
            inside &= abs(follow[i, j]) <= validate.LARGEST
            inside &= abs(rest[i, j]) <= LARGEST_VARIANCE
            inside &= abs(covariance[i, j]) <= LARGEST_VARIANCE
    return inside


def _own(array: Array) -> Array:
    """`array`, or a copy where kernels would have to be compiled anew for how it lies in memory."""
    return array if array.flags.carray else array.copy()
