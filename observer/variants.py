"""The observer with one idea changed at a time, by name; what each is worth, `evaluate.py --ablation` tells.

Add a variant as a line of keywords for `HapticSLAM`. Some need no map: `PoseOnly` is as sure of the pose, and faster.
"""

from __future__ import annotations

from typing import Any

from haptic_env.hand import Hand
from observer.brackets import KALMAN_DYNAMICS, OBSERVERS
from observer.contact_model import ContactModel
from observer.fastslam import HapticSLAM
from observer.pose_only import PoseOnly

VARIANTS: dict[str, dict[str, Any]] = {
    "no_lag": {"lag": 0},
    "no_contact_dynamics": {"dynamics": KALMAN_DYNAMICS},
    "no_forward_model": {"motion": "delta_pose"},
    "no_scan_matching": {"candidates": 1},
    "sampled_matching": {"matching": "sample"},
    "one_particle": {"particles": 1},
    "no_tempering": {"contact_model": ContactModel(temper=1.0, sustained=ContactModel.touch)},
    "no_caution": {"contact_model": ContactModel(caution=0.0)},
    "no_hindsight": {"in_hindsight": False},
    "no_prior": {"contact_model": ContactModel(prior=0.5)},
}
WITHOUT_MAP: dict[str, dict[str, Any]] = {  # keywords for `PoseOnly`
    "smoother_pose": {"dynamics": KALMAN_DYNAMICS},
}
Observer = HapticSLAM | PoseOnly
WITH_PARTICLES = ("haptic_slam", "paper", *VARIANTS)
ABLATION = ("haptic_slam", *VARIANTS, "paper")
NAMES = (*OBSERVERS, *VARIANTS, *WITHOUT_MAP)


def make_observer(name: str, hand: Hand, sigma_deg: float, particles: int, **keywords: Any) -> Observer:
    """The observer or variant `name` for `hand`; `particles` where it has any and does not say how many."""
    if name in WITHOUT_MAP:
        return PoseOnly(hand, sigma_deg, **WITHOUT_MAP[name], **keywords)
    if name in WITH_PARTICLES:
        keywords = {"particles": particles, **VARIANTS.get(name, {}), **keywords}
    return OBSERVERS["haptic_slam" if name in VARIANTS else name](hand, sigma_deg, **keywords)
