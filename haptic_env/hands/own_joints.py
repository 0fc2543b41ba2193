"""The joints of a hand of one's own: their ranges, where they rest and what drives them.

A joint of which no torque is told is driven as gently as a human finger is: see `gentle`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import mujoco
import numpy as np

from haptic_env import validate
from haptic_env.hand import Hand
from haptic_env.hands import description
from haptic_env.hands.drives import Drive
from haptic_env.hands.own_model import OwnModel

MOST_JOINTS = 64
SLOWEST = 0.02  # s in which a joint comes to its speed
DAMPING = 0.004  # N·m·s/rad at least
SPEED, GIVE = 4.4, 1.6  # rad/s at full torque, and rad that full torque holds against the spring
STROKE = 0.5 * np.pi  # rad that the range of a slide is, where no lever arm is told
TURN = (-np.pi, np.pi)  # rad, range of a joint that has none
MOST = {"torque": 1e3, "damping": 1e4, "stiffness": 1e5}
JOINT = mujoco.mjtJoint


class OwnJoint(NamedTuple):
    """A joint of the hand.

    Attributes:
        index: in the model.
        arm: m that it slides in one radian; 0: it turns.
        limits: rad, the least and the largest angle.
        rest: rad, where an episode starts.
        told: what the file says of it.
        note: what was taken as usual; "" for nothing.
    """

    index: int
    arm: float
    limits: tuple[float, float]
    rest: float
    told: Mapping[str, Any]
    note: str


def joints_of(own: OwnModel) -> dict[str, OwnJoint]:
    """Find the joints of a hand: all below its root.

    Args:
        own: its model.

    Returns:
        The joints by their names.

    Raises:
        ValueError: for free and ball joints, those without a name, and what the file says that makes no sense.
    """
    model, told = own.model, own.told.joints
    indices = [j for j in range(model.njnt) if model.jnt_bodyid[j] in own.below]
    names = [model.joint(j).name for j in indices]
    if not indices:
        raise ValueError(f"no joint moves its skin: there is none below {own.name(own.root)!r}")
    if len(indices) > MOST_JOINTS:
        raise ValueError(f"it has {len(indices)} joints; at most {MOST_JOINTS} are valid")
    for name in told:
        validate.choice("joint", name, [each for each in names if each])
    return {name: _joint(own, j, name) for j, name in zip(indices, names, strict=True)}


def drives_of(hand: Hand, joints: Mapping[str, OwnJoint]) -> dict[str, Drive]:
    """Find what drives joints: as the file says, and gently where it does not.

    Args:
        hand: with these joints, whatever drives them.
        joints: by their names.

    Returns:
        The drives by the names of joints.

    Raises:
        ValueError: for a value out of its range.
    """
    inertia = dict(zip(hand.joint_names, hand.model.dof_M0, strict=True))
    return {name: _drive(name, each, float(inertia[name])) for name, each in joints.items()}


def gentle(inertia: float, rest: float) -> Drive:
    """Find how to drive a joint of which nothing is told: at the speed of a human finger, with a spring to its rest.

    A joint of much inertia is damped the more, so that it comes to its speed as soon as others.

    Args:
        inertia: kg·m² about the joint.
        rest: rad.

    Returns:
        The drive.
    """
    damping = max(inertia / SLOWEST, DAMPING)
    return Drive(SPEED * damping, damping, SPEED * damping / GIVE, float(np.rad2deg(rest)))


def _joint(own: OwnModel, j: int, name: str) -> OwnJoint:
    model, kind = own.model, JOINT(own.model.jnt_type[j])
    if kind not in (JOINT.mjJNT_HINGE, JOINT.mjJNT_SLIDE):
        of = name or f"of body {own.name(model.jnt_bodyid[j])}"
        raise ValueError(
            f"joint {of!r} is a {kind.name.removeprefix('mjJNT_').lower()} joint; a joint is told by one angle: hinges "
            "and slides are valid, three hinges in place of a ball"
        )
    if "/" in name or not name:
        raise ValueError(f"joint {name!r} of body {own.name(model.jnt_bodyid[j])!r} needs a name, without a /")
    slides = kind == JOINT.mjJNT_SLIDE
    told, unit, scale = own.told.joints.get(name, {}), "m" if slides else "deg", 1.0 if slides else np.pi / 180.0
    description.joint_keys(name, told, slides)
    note = ""
    if f"range_{unit}" in told:
        ends = scale * validate.array(f"range_{unit} of joint {name!r}", told[f"range_{unit}"], (2,), bound=720.0)
    elif model.jnt_limited[j]:
        ends = model.jnt_range[j]
    elif slides:
        raise ValueError(f"joint {name!r} slides without a range; give it one: [joint.{name}] range_m = [LOW, HIGH]")
    else:
        ends, note = np.array(TURN), f"joint {name!r} has no range in the model: it turns by ±180°"
    low, high = map(float, ends)
    if not low < high:
        raise ValueError(f"range of joint {name!r} must go from a number to a larger one, got {ends.tolist()}")
    per_radian = 1.0
    if slides:
        usual = (high - low) / STROKE
        per_radian = validate.number(f"lever_arm of joint {name!r}", told.get("lever_arm", usual), 1e-4, 1.0, unit="m")
    key = f"rest_{unit}"
    rest = validate.number(f"{key} of joint {name!r}", told.get(key, 0.0), -720.0, 720.0, unit=unit) * scale
    if key not in told:
        rest = min(max(rest, low), high)
    if not low - 1e-9 <= rest <= high + 1e-9:
        raise ValueError(
            f"{key} of joint {name!r} must lie in its range, [{low / scale:g}, {high / scale:g}] {unit}, got "
            f"{told[key]}"
        )
    limits = low / per_radian, high / per_radian
    return OwnJoint(j, per_radian if slides else 0.0, limits, rest / per_radian, told, note)


def _drive(name: str, joint: OwnJoint, inertia: float) -> Drive:
    """What is told, of a slide in N, N·s/m and N/m; and the rest as gentle as fits to that."""
    usual, told, arm = gentle(inertia, joint.rest), joint.told, joint.arm or 1.0

    def number(key: str, otherwise: float, scale: float) -> float:
        if key not in told:
            return otherwise
        least = 0.0 if key == "stiffness" else 1e-6
        return scale * validate.number(f"{key} of joint {name!r}", told[key], least, MOST[key])

    torque = number("torque", usual.torque, arm)
    damping = number("damping", max(torque / SPEED, inertia / SLOWEST), arm**2)
    return Drive(torque, damping, number("stiffness", torque / GIVE, arm**2), usual.relaxed)
