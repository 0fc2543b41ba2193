"""Which joints of a hand of one's own follow others, as its model says.

`<equality><joint>` says so, `<equality><tendon>` of two joints, and `<mimic>` of a URDF, which is read as the first.
Tendons with a range hold joints near each other.

Couplings are kept as stiff as contacts are. A follower has no motor: that of its root moves both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.polynomial import Polynomial

from haptic_env import validate
from haptic_env.coupling import DEGREES, SOLIMP, SOLREF, Coupling, Couplings, in_order
from haptic_env.hand import Hand, parse
from haptic_env.hands.own_joints import OwnJoint
from haptic_env.hands.own_model import OwnModel

EQUALITY, JOINT = mujoco.mjtEq, mujoco.mjtWrap.mjWRAP_JOINT
OF_LEADERS = ("torque", "rest_deg", "rest_m")  # what is told of a root alone


class Held(NamedTuple):
    """A tendon that keeps a sum of angles within bounds.

    Attributes:
        name: of the tendon.
        shares: by their joints' names, what the sum has of each (by rad).
        bounds: the least and the largest sum.
    """

    name: str
    shares: dict[str, float]
    bounds: tuple[float, float]


class OwnCouplings(NamedTuple):
    """What moves joints of a hand together.

    Attributes:
        couplings: of its joints, by their order among them.
        held: tendons that hold joints near each other.
        notes: what was taken and what left out, a line each.
    """

    couplings: Couplings
    held: tuple[Held, ...]
    notes: list[str]


class _Tie(NamedTuple):
    """A coupling as a model has it: angle (or m) of `follower` = `curve` of that of `leader`; by which `tendon`, if by
    one."""

    tendon: int | None
    follower: int
    leader: int
    curve: Polynomial


def couplings_of(own: OwnModel, joints: Mapping[str, OwnJoint]) -> OwnCouplings:
    """Find which joints follow which.

    Args:
        own: the model of the hand.
        joints: by their names.

    Returns:
        Couplings, tendons and notes.

    Raises:
        ValueError: for joints that follow in a ring, or two others, and for what is told of a follower and is its
            leader's.
    """
    model, names = own.model, list(joints)
    number = {joints[name].number: index for index, name in enumerate(names)}
    notes: list[str] = []
    ties = [tie for e in range(model.neq) if (tie := _tie(model, e, number, notes)) is not None]
    found: list[Coupling] = []
    for tie in ties:
        follower, leader = number[tie.follower], number[tie.leader]
        if any(each.follower == follower for each in found):
            raise ValueError(f"joint {names[follower]!r} follows two others; a joint can follow one")
        # In radians of both, slides too (`haptic_env.sliding`).
        of, by = (joints[names[each]].arm or 1.0 for each in (follower, leader))
        curve = tie.curve(Polynomial([0.0, by])) / of
        coefficients = tuple(map(float, np.pad(curve.coef, (0, DEGREES))[:DEGREES]))
        found.append(Coupling(follower, leader, coefficients))
        for key in OF_LEADERS:
            if key in joints[names[follower]].told:
                raise ValueError(f"joint {names[follower]!r} follows {names[leader]!r}: {key} can be told of that one")
        told = f"joint {names[follower]!r} follows {_shown(coefficients, names[leader])}"
        notes.append(f"{told}, and has no motor of its own")
    try:
        couplings = Couplings(len(names), in_order(found))
    except ValueError as error:
        ring = validate.listed(names[each.follower] for each in found)
        raise ValueError(f"joints follow each other in a ring, among {ring}: one of them must lead") from error
    rest = {*range(model.ntendon)} - {tie.tendon for tie in ties}
    held = tuple(each for t in sorted(rest) if (each := _held(model, t, number, joints)) is not None)
    for each in held:
        low, high = each.bounds
        total = " + ".join(f"{share:.3g}·{name}" for name, share in each.shares.items()).replace("+ -", "- ")
        told = f"tendon {each.name!r} keeps {total} from {low:.3g} to {high:.3g}"
        notes.append(f"{told}; observers without torques do not know it")
    if others := len(rest) - len(held):
        notes.append(f"tendons of the model that couple no two joints of the hand ({others}) are left out")
    return OwnCouplings(couplings, held, notes)


def at_rest(joints: Mapping[str, OwnJoint], couplings: Couplings) -> dict[str, OwnJoint]:
    """Put followers where their leaders rest.

    Args:
        joints: by their names.
        couplings: of these joints.

    Returns:
        The joints.

    Raises:
        ValueError: for a follower that would rest beyond its range.
    """
    rest = couplings.follow(np.array([joint.rest for joint in joints.values()]))
    found = {}
    for (name, joint), angle, follows in zip(joints.items(), rest, couplings.follows, strict=True):
        low, high = joint.limits
        if follows and not low - 1e-3 <= angle <= high + 1e-3:
            leader = list(joints)[couplings.root[list(joints).index(name)]]
            scale, unit = (joint.arm, "m") if joint.arm else (float(np.rad2deg(1.0)), "deg")
            raise ValueError(
                f"joint {name!r} follows {leader!r} and would rest at {scale * angle:.4g} {unit}, beyond its range, "
                f"[{scale * low:.4g}, {scale * high:.4g}] {unit}; give {leader!r} another rest: [joint.{leader}]"
            )
        found[name] = joint._replace(rest=float(angle)) if follows else joint
    return found


def tied(hand: Hand, names: Sequence[str], coupled: OwnCouplings) -> Hand:
    """Couple the joints of a hand.

    Args:
        hand: whose joints are apart.
        names: of the joints that `coupled` counts.
        coupled: what moves them together.

    Returns:
        The hand.
    """
    if not coupled.couplings and not coupled.held:
        return hand
    tree = parse(hand.xml)
    for follower, leader, coefficients in coupled.couplings.each:
        ends = {"joint1": names[follower], "joint2": names[leader]}
        tree.equality.add("joint", **ends, polycoef=coefficients, solref=SOLREF, solimp=SOLIMP)
    for held in coupled.held:
        stiff = {"solreflimit": SOLREF, "solimplimit": SOLIMP}
        tendon = tree.tendon.add("fixed", name=held.name, limited=True, range=held.bounds, **stiff)
        for joint, share in held.shares.items():
            tendon.add("joint", joint=joint, coef=share)
    return replace(hand, xml=tree.to_xml_string())


def _tie(model: mujoco.MjModel, e: int, number: Mapping[int, int], notes: list[str]) -> _Tie | None:
    """The coupling of a constraint; None: it is none of two joints of the hand, or not one that can be kept."""
    kind, name = EQUALITY(model.eq_type[e]), model.equality(e).name or f"number {e + 1}"
    first, second = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
    curve = Polynomial(model.eq_data[e, :DEGREES])
    if kind == EQUALITY.mjEQ_JOINT:
        if first not in number and second not in number:
            return None
        if not model.eq_active0[e] or not {first, second} <= {*number}:
            notes.append(f"constraint {name!r} is left out: it is inactive, or not of two joints of the hand")
            return None
        at, by = (float(model.qpos0[model.jnt_qposadr[joint]]) for joint in (first, second))
        return _Tie(None, first, second, curve(Polynomial([-by, 1.0])) + at)
    if kind != EQUALITY.mjEQ_TENDON:
        return None
    shares = _shares(model, first)
    if second >= 0 or len(shares) != 2 or not {*shares} <= {*number} or not model.eq_active0[e]:
        if any(joint in number for joint in shares):
            notes.append(f"constraint {name!r} of tendons is left out: only that of one tendon of two joints is kept")
        return None
    (leader, lead), (follower, share) = sorted(shares.items())
    length = float(model.tendon_length0[first]) + float(curve.coef[0])
    return _Tie(first, follower, leader, Polynomial([length / share, -lead / share]))


def _shares(model: mujoco.MjModel, tendon: int) -> dict[int, float]:
    """What a tendon's length has of each joint's angle; none of a tendon that runs through space."""
    start, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    wraps = range(start, start + count)
    if any(model.wrap_type[w] != JOINT for w in wraps):
        return {}
    return {int(model.wrap_objid[w]): float(model.wrap_prm[w]) for w in wraps if model.wrap_prm[w]}


def _held(model: mujoco.MjModel, tendon: int, number: Mapping[int, int], joints: Mapping[str, OwnJoint]) -> Held | None:
    shares, names = _shares(model, tendon), list(joints)
    if not model.tendon_limited[tendon] or len(shares) < 2 or not {*shares} <= {*number}:
        return None
    by_name = {names[number[joint]]: share for joint, share in shares.items()}
    scaled = {name: share * (joints[name].arm or 1.0) for name, share in by_name.items()}
    low, high = map(float, model.tendon_range[tendon])
    return Held(model.tendon(tendon).name or f"number {tendon + 1}", scaled, (low, high))


def _shown(coefficients: tuple[float, ...], leader: str) -> str:
    """A polynomial of the leader's angle in words."""
    constant, slope, *curved = coefficients
    if any(curved):
        return f"a curve of {leader!r}"
    offset = f"{np.rad2deg(constant):+.3g}°" if constant else ""
    return f"{leader!r} ({slope:.4g}·{leader}{offset and f' {offset}'})"
