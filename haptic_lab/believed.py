"""What observers are told of the noise: what is so, unless they are to believe something else (`--believed-…`)."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from haptic_env import validate
from haptic_env.hand import Hand
from haptic_lab import faults
from haptic_lab.conditions import NOISES as NOISY
from haptic_lab.conditions import check_contacts
from haptic_lab.faults import FAULTS
from observer import HapticSLAM
from observer.brackets import WHITE_ONLY
from observer.pose import noise_presets
from observer.pose.noise_presets import NOISES

UNKNOWN = "unknown"  # for a sigma that is to be found out
TOLD = tuple(name for name in NOISY if name in inspect.signature(HapticSLAM).parameters)  # of what is so


def as_sigma(text: str) -> float | str:
    """Read a sigma from the command line.

    Args:
        text: a number, or `UNKNOWN`.

    Returns:
        Degrees, or `UNKNOWN`.

    Raises:
        argparse.ArgumentTypeError: for anything else.
    """
    if text == UNKNOWN:
        return text
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a number or {UNKNOWN}, got {text!r}") from None


@dataclass(frozen=True, kw_only=True)
class Believed:
    """What observers believe in place of what is so; None: what is so, or what the preset `believed` says.

    Attributes:
        believed: a name of `NOISES`.
        believed_sigma_deg: SD of the white noise of felt angles, degrees; `UNKNOWN`: to be found out.
        believed_bias_deg: SD of the constant offset of each joint, degrees.
        believed_drift_deg: SD of the slow error of each joint, degrees.
        believed_drift_seconds: time constant of the drift.
        believed_proportional: SD of white noise as a fraction of the angle.
        believed_motor_noise: SD as a fraction of the commanded torque.
        believed_start_std_deg: SD of each joint about the rest pose at the start, degrees (else 0).
        believed_contact_miss: probability that a touch is not felt.
        believed_contact_false_alarm: probability that one is felt that is none.
        believed_contact_confusion: probability that one is felt at a neighbouring patch.
        believed_patches_stuck: the patches that always report one, as `haptic_lab.faults` has it, or the probability of
            each.
        believed_patches_dead: the patches that never do, likewise.
    """

    believed: str | None = None
    believed_sigma_deg: float | str | None = None
    believed_bias_deg: float | None = None
    believed_drift_deg: float | None = None
    believed_drift_seconds: float | None = None
    believed_proportional: float | None = None
    believed_motor_noise: float | None = None
    believed_start_std_deg: float | None = None
    believed_contact_miss: float | None = None
    believed_contact_false_alarm: float | None = None
    believed_contact_confusion: float | None = None
    believed_patches_stuck: float | str | None = None
    believed_patches_dead: float | str | None = None

    def check_believed(self) -> None:
        """Check all of it, as far as it is the same for every hand.

        Raises:
            ValueError: for a value out of its range; it names the flag.
        """
        if self.believed is not None:
            validate.choice("--believed", self.believed, NOISES)
        sigma = self.believed_sigma_deg
        if isinstance(sigma, str):
            if sigma != UNKNOWN:
                raise ValueError(f"--believed-sigma-deg must be a number or {UNKNOWN!r}, got {validate.shown(sigma)}")
        elif sigma is not None:
            validate.number("--believed-sigma-deg", sigma, 0.0, 90.0, unit="degrees")
        for name in ("bias_deg", "drift_deg", "start_std_deg"):
            self._check(name, 0.0, 90.0, "degrees")
        for name in ("proportional", "motor_noise", "contact_miss", "contact_false_alarm", "contact_confusion"):
            self._check(name, 0.0, 1.0, "")
        for name in FAULTS:
            given = getattr(self, f"believed_{name}")
            if isinstance(given, str | list | tuple):
                faults.as_keyword(given)
            else:
                self._check(name, 0.0, 1.0, "")
        if self.believed_drift_seconds is not None:
            validate.seconds("--believed-drift-seconds", self.believed_drift_seconds)

    def _check(self, name: str, low: float, high: float, unit: str) -> None:
        value = getattr(self, f"believed_{name}")
        if value is not None:
            validate.number(f"--believed-{name.replace('_', '-')}", value, low, high, unit=unit)

    def told(self, noise: Mapping[str, Any], hand: Hand | None = None) -> dict[str, Any]:
        """Say what observers are told.

        Args:
            noise: that there is, keywords of the environment.
            hand: whose joints may have figures of their own in a preset; None: joints are alike.

        Returns:
            Keywords of observers.
        """
        said = {name.removeprefix("believed_"): getattr(self, name) for name in BELIEVED[1:]}
        said |= {name: faults.as_keyword(said[name]) for name in FAULTS if said[name] is not None}
        told = {name: noise[name] for name in TOLD if name in noise}
        if self.believed is not None:
            told |= WHITE_ONLY | (NOISES[self.believed] if hand is None else noise_presets.of(self.believed, hand))
        told |= {name: value for name, value in said.items() if value is not None}
        return {name: None if isinstance(value, str) else value for name, value in told.items()}  # `UNKNOWN`

    def check_told(self, env: str, noise: Mapping[str, Any]) -> None:
        """Check what observers are told of contacts against the patches of a hand.

        Args:
            env: id of its environment.
            noise: that there is, keywords of the environment.

        Raises:
            ValueError: for patches that this hand has not, or that are told to be both stuck and dead.
        """
        try:
            check_contacts(env, self.told(noise))
        except ValueError as error:
            raise ValueError(f"what observers believe: {error}") from error


BELIEVED = tuple(each.name for each in fields(Believed))


def add_flags(add: Callable[..., Any]) -> None:
    """Let a command take what observers believe.

    Args:
        add: adds an argument to its parser.
    """
    names = ", ".join(NOISES)
    so = "(default: what is so)"
    add("--believed", metavar="NAME", help=f"observers believe in the noise of a preset, {names} {so}")
    add("--believed-sigma-deg", type=as_sigma, help=f"they believe this sigma, or find it out: {UNKNOWN} {so}")
    add("--believed-bias-deg", type=float, help=f"they believe in a constant error of this SD {so}")
    add("--believed-drift-deg", type=float, help=f"and in a slow one {so}")
    add("--believed-drift-seconds", type=float, help=f"with this time constant {so}")
    add("--believed-proportional", type=float, help=f"and in noise that grows with the angle {so}")
    add("--believed-motor-noise", type=float, help=f"and in this noise of torques {so}")
    add("--believed-start-std-deg", type=float, help="and that the hand starts so far from its rest pose (default 0)")
    add("--believed-contact-miss", type=float, help=f"and that touches are missed with this probability {so}")
    add("--believed-contact-false-alarm", type=float, help=f"and that patches ring falsely with this one {so}")
    add("--believed-contact-confusion", type=float, help=f"and for a neighbour with this one {so}")
    add("--believed-patches-stuck", type=faults.as_faults, help=f"and that patches always ring; {faults.HELP} {so}")
    add("--believed-patches-dead", type=faults.as_faults, help=f"and that they never do, likewise {so}")
