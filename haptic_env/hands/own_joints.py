"""The joints of a hand of one's own: their ranges, where they rest and what drives them.

A joint of which no torque is told is driven as gently as that of a human finger: see `gentle`. One that follows another
is moved by the motor of that one, which is as strong as both would be.
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
FORCE, SPEED = 0.45, 4.4  # N at the end of what a joint moves, and rad/s, at full torque
GIVE = 1.6  # rad from where it rests, at most, that full torque holds against the spring
SHORTEST, USUAL_REACH = 0.01, 0.05  # m from a joint's axis: at least, and that at which slides are as fast as turns
STROKE = 0.5 * np.pi  # rad that the range of a slide is, where no lever arm is told
NO_MOTOR = 1e-4  # of its leader's torque: all that moves a follower by itself, for every joint has a motor in the model
TURN = (-np.pi, np.pi)  # rad, range of a joint that has none
MOST = {"torque": 1e3, "damping": 1e4, "stiffness": 1e5}
JOINT = mujoco.mjtJoint


class OwnJoint(NamedTuple):
    """A joint of the hand.

    Attributes:
        number: of the joint in the model.
        arm: m that it slides in one radian; 0: it turns.
        limits: rad, the least and the largest angle.
        rest: rad, where an episode starts.
        told: what the file says of it.
        note: what was taken as usual; "" for nothing.
    """

    number: int
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
    data, found = hand.at_rest(), {}
    ends, couplings = hand.link_ends(data), hand.couplings
    for index, (name, moved) in enumerate(zip(hand.joint_names, hand.moves.T, strict=True)):
        arms = np.cross(data.xaxis[index], ends[moved] - data.xanchor[index])
        found[name] = _drive(name, joints[name], float(np.linalg.norm(arms, axis=1).max(initial=SHORTEST)))
    drives, slopes = list(found.values()), np.abs(couplings.slopes(hand.rest_pose))
    for index in map(int, np.flatnonzero(couplings.follows)):
        name, root = hand.joint_names[index], int(couplings.root[index])
        leader, mine = hand.joint_names[root], drives[index]
        if "torque" not in joints[leader].told:
            found[leader] = found[leader]._replace(torque=found[leader].torque + float(slopes[index]) * mine.torque)
        stiffness = mine.stiffness if "stiffness" in joints[name].told else 0.0
        found[name] = mine._replace(torque=NO_MOTOR * drives[root].torque, stiffness=stiffness)
    return found


def gentle(joint: OwnJoint, reach: float) -> Drive:
    """Find how to drive a joint of which nothing is told: as gently as a human finger, with a spring to its rest.

    What it moves presses with `FORCE` at its end, and goes there at `SPEED` at most; all its torque holds it at the end
    of its range, or at `GIVE` from where it rests. So are the drives of human joints (`haptic_env.hands.drives`).

    Args:
        joint: that is driven.
        reach: m, from its axis to the end of what it moves.

    Returns:
        The drive.
    """
    low, high = joint.limits
    way = min(max(high - joint.rest, joint.rest - low), GIVE)
    torque = FORCE * (joint.arm or max(reach, SHORTEST))
    fastest = SPEED * USUAL_REACH / joint.arm if joint.arm else SPEED
    return Drive(torque, torque / fastest, torque / way, float(np.rad2deg(joint.rest)))


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


def _drive(name: str, joint: OwnJoint, reach: float) -> Drive:
    """What is told, of a slide in N, N·s/m and N/m; and the rest as gentle as fits to that."""
    usual, told, arm = gentle(joint, reach), joint.told, joint.arm or 1.0

    def number(key: str, otherwise: float, scale: float) -> float:
        if key not in told:
            return otherwise
        least = 0.0 if key == "stiffness" else 1e-6
        return scale * validate.number(f"{key} of joint {name!r}", told[key], least, MOST[key])

    torque = number("torque", usual.torque, arm)
    more = torque / usual.torque
    damping = number("damping", more * usual.damping, arm**2)
    return Drive(torque, damping, number("stiffness", more * usual.stiffness, arm**2), usual.relaxed)
