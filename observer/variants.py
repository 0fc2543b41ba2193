"""The observer with one idea changed at a time, by name; what each is worth, `evaluate.py --ablation` tells.

Add a variant as a line of keywords for `HapticSLAM`. Names joined by "+" change several things, from left to right:
"paper+no_scan_matching". Some need no map: `PoseOnly` is as sure of the pose, and faster.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from haptic_env import validate
from haptic_env.hand import Hand
from observer.brackets import KALMAN_DYNAMICS, OBSERVERS
from observer.fastslam import HapticSLAM
from observer.maps.contact_model import ContactModel
from observer.pose_only import PoseOnly

VARIANTS: dict[str, dict[str, Any]] = {
    "no_lag": {"lag": 0},
    "no_contact_dynamics": {"dynamics": KALMAN_DYNAMICS},
    "no_forward_model": {"motion": "delta_pose"},
    "no_torques": {"motion": "kinematic"},
    "no_scan_matching": {"candidates": 1},
    "sampled_matching": {"matching": "sample"},
    "one_particle": {"particles": 1},
    "no_tempering": {"contact_model": ContactModel(temper=1.0, sustained=ContactModel.touch, repeats=0.0)},
    "no_caution": {"contact_model": ContactModel(caution=0.0)},
    "no_hindsight": {"in_hindsight": False},
    "no_prior": {"contact_model": ContactModel(prior=0.5)},
}
WITHOUT_MAP: dict[str, dict[str, Any]] = {  # keywords for `PoseOnly`
    "smoother_pose": {"dynamics": KALMAN_DYNAMICS},
}
Observer = HapticSLAM | PoseOnly
FULL = "haptic_slam"
SECOND_LOOK = "second_look"
NO_SECOND_LOOK = ("no_forward_model", "no_torques", "sampled_matching", "no_hindsight")  # what it cannot do without
WITH_PARTICLES = (FULL, "paper", "white", SECOND_LOOK)
BADLY_KNOWN = ("no_forward_model", "no_torques", "paper")  # poses of which maps may have more to say
ABLATION = (FULL, *VARIANTS, "paper", *(f"{name}+no_scan_matching" for name in BADLY_KNOWN))
NAMES = (*OBSERVERS, *VARIANTS, *WITHOUT_MAP)


def check(what: str, name: str, also: Collection[str] = ()) -> str:
    """Check the name of an observer.

    Args:
        what: the argument it is given for.
        name: of an observer or a variant, or several that add up.
        also: what else may be added to any observer.

    Returns:
        The name.

    Raises:
        ValueError: for any other, listing what there is.
    """
    base, *changes = name.split("+") if isinstance(name, str) else [name]
    validate.choice(what, base, (*WITH_PARTICLES, *VARIANTS) if {*changes} - {*also} else NAMES)
    for change in changes:
        validate.choice(what, change, (*VARIANTS, *also))
    return name


def make_observer(name: str, hand: Hand, sigma_deg: float | None, particles: int, **keywords: Any) -> Observer:
    """Make an observer by name.

    Args:
        name: of an observer or a variant, or several that add up.
        hand: that explores.
        sigma_deg: degrees, SD of white noise of the felt angles; None: it is found out.
        particles: N, where it has any and does not say how many.
        **keywords: what else `HapticSLAM`, or `PoseOnly`, is told.

    Returns:
        The observer.

    Raises:
        ValueError: for a name that is none, or a value out of range.
    """
    if check("name", name) in WITHOUT_MAP:
        return PoseOnly(hand, sigma_deg, **WITHOUT_MAP[name], **keywords)
    parts = name.split("+")
    base = parts.pop(0) if parts[0] in OBSERVERS else FULL
    given: dict[str, Any] = {"particles": particles} if base in WITH_PARTICLES else {}
    for change in parts:
        given |= VARIANTS[change]
    return OBSERVERS[base](hand, sigma_deg, **{**given, **keywords})
