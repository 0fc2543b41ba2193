"""What every figure is shown between: the same map update at other poses.

Shapes: J joints, P patches. The ceiling, `TruePose`, is the floor, `DeadReckoning`, without noise: whoever runs it
hands it the true angles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from haptic_env import validate
from haptic_env.hand import Hand
from haptic_env.sensors import Spread
from observer.fastslam import HapticSLAM
from observer.pose.contact_dynamics import ContactDynamics
from observer.second_look import SecondLook

KALMAN_DYNAMICS = ContactDynamics(constrained=False)
WHITE_ONLY = {"bias_deg": 0.0, "drift_deg": 0.0, "proportional": 0.0, "start_std_deg": 0.0}  # noise of felt angles
HONEST_PATCHES = dict.fromkeys(
    ("contact_miss", "contact_false_alarm", "contact_confusion", "patches_stuck", "patches_dead"), 0.0
)


class OneMap(HapticSLAM):
    """One map at the mean pose: no particles, no say of the map in the pose."""

    def __init__(self, hand: Hand, sigma_deg: Spread | None = 3.0, **keywords: Any) -> None:
        """Take the keyword arguments of `HapticSLAM`, but for particles and candidates.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles; None: it is found out.
            **keywords: what else `HapticSLAM` is told.

        Raises:
            ValueError: for a value out of range.
        """
        super().__init__(hand, sigma_deg, particles=1, candidates=1, **keywords)


class DeadReckoning(OneMap):
    """Floor: the map at the raw angles, which knows no `lag`."""

    def __init__(self, hand: Hand, sigma_deg: Spread | None = 3.0, *, lag: int | None = None, **keywords: Any) -> None:
        """Take the keyword arguments of `HapticSLAM`, but for particles and candidates, motion and lag.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles; None: 3, as nothing tells of it.
            lag: steps, of which there are none: 0 or None.
            **keywords: what else `HapticSLAM` is told.

        Raises:
            ValueError: for a value out of range.
        """
        if lag is not None:
            validate.integer("lag of raw angles", lag, 0, 0)
        super().__init__(hand, sigma_deg, **{**keywords, "motion": "raw_angles", "lag": 0})


class TruePose(DeadReckoning):
    """Ceiling: the map at the true pose, which it is handed as the felt one. What is told of noise of angles is not
    used; what is told of contacts is."""

    def __init__(self, hand: Hand, sigma_deg: Spread | None = 0.0, **keywords: Any) -> None:
        """Take the keyword arguments of `HapticSLAM`, but for particles and candidates, motion and lag.

        Args:
            hand: with J joints and P patches.
            sigma_deg: not used.
            **keywords: what else `HapticSLAM` is told, of which what is of noise of angles is not used.

        Raises:
            ValueError: for a value out of range.
        """
        super().__init__(hand, 0.0, **{**keywords, **WHITE_ONLY})


class Kalman(OneMap):
    """The map at the online mean of an extended Kalman filter that takes contact for noise of the finger's joints."""

    def __init__(self, hand: Hand, sigma_deg: Spread | None = 3.0, **keywords: Any) -> None:
        """Take the keyword arguments of `HapticSLAM`, but for particles and candidates.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles; None: it is found out.
            **keywords: what else `HapticSLAM` is told; `lag` and `dynamics` change what it is.

        Raises:
            ValueError: for a value out of range.
        """
        super().__init__(hand, sigma_deg, **{"lag": 0, "dynamics": KALMAN_DYNAMICS, **keywords})


class Smoother(OneMap):
    """The same filter with the fixed lag."""

    def __init__(self, hand: Hand, sigma_deg: Spread | None = 3.0, **keywords: Any) -> None:
        """Take the keyword arguments of `HapticSLAM`, but for particles and candidates.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles; None: it is found out.
            **keywords: what else `HapticSLAM` is told; `dynamics` changes what it is.

        Raises:
            ValueError: for a value out of range.
        """
        super().__init__(hand, sigma_deg, **{"dynamics": KALMAN_DYNAMICS, **keywords})


class White(HapticSLAM):
    """The observer that believes in white noise of `sigma_deg` and nothing else, whatever it is told of other noise."""

    def __init__(self, hand: Hand, sigma_deg: Spread | None = 3.0, particles: int = 200, **keywords: Any) -> None:
        """Take the keyword arguments of `HapticSLAM`.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles; None: it is found out.
            particles: N.
            **keywords: what else `HapticSLAM` is told; of other noise it may be anything.

        Raises:
            ValueError: for a value out of range.
        """
        super().__init__(hand, sigma_deg, particles, **{**keywords, **WHITE_ONLY, **HONEST_PATCHES})


OBSERVERS: dict[str, Callable[..., HapticSLAM]] = {
    "floor": DeadReckoning,
    "paper": HapticSLAM.paper,
    "kalman": Kalman,
    "smoother": Smoother,
    "white": White,
    "haptic_slam": HapticSLAM,
    "second_look": SecondLook,
    "ceiling": TruePose,
}
