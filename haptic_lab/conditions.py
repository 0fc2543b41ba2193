"""What may vary from trial to trial within one table, besides the object and the seed."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields
from typing import Any

import agents
from haptic_env import hands, registration, sensors, validate
from haptic_env.explore import ExploreEnv
from haptic_env.patches import Patches
from haptic_lab import faults
from haptic_lab.faults import FAULTS

TRUST = (
    "run what a model.zip, or the module of a class that a file names, has in it, as you would run a program of "
    "whoever made it (docs/learning.md)"
)
_DEFAULTS = {name: each.default for name, each in inspect.signature(ExploreEnv).parameters.items()}


def check_policy(name: str, trust: bool) -> None:
    """Check the policy that a command is told of.

    Args:
        name: of a policy, or the path of a model.
        trust: whether a model may run code when it is read.

    Raises:
        ValueError: for neither, or a model that cannot be read or is not to be trusted.
    """
    agents.find(name, "--policy")
    if agents.is_model(name):
        try:
            agents.load_model(name, trust=trust)
        except ImportError as error:
            raise ValueError(f"--policy {name}: {error}") from error


def noise_of(told: Any) -> dict[str, Any]:
    """Say all noise but sigma as environments are told it.

    Args:
        told: with an attribute for each of `DEFAULTS`, as command lines and files have them.

    Returns:
        Keyword arguments of the environment.

    Raises:
        ValueError: for a text that names no patches.
    """
    noise = {name: getattr(told, name) for name in DEFAULTS}
    return noise | {name: faults.as_keyword(noise[name]) for name in FAULTS}


def check_noise(noise: Mapping[str, Any]) -> None:
    """Check all noise but sigma, as far as it is the same for every hand.

    Args:
        noise: keyword arguments of the environment.

    Raises:
        ValueError: for a value out of its range.
    """
    # The sensors know what they can be.
    sensors.Bias(noise["bias_deg"])
    sensors.Drift(noise["drift_deg"], noise["drift_seconds"], step_seconds=1.0)
    sensors.Proportional(noise["proportional"])
    sensors.MotorNoise(noise["motor_noise"])
    sensors.ContactDetection(noise["contact_miss"], noise["contact_false_alarm"])
    validate.number("contact_confusion", noise["contact_confusion"], 0.0, 1.0)


def check_contacts(env: str, noise: Mapping[str, Any]) -> None:
    """Check what is said of contacts against the patches of a hand.

    Args:
        env: id of its environment.
        noise: keyword arguments of the environment; what it does not say is as usual.

    Raises:
        ValueError: for a value out of its range, and for patches that this hand has not.
    """
    if not lies(noise):
        return
    try:
        patches = hands.make(registration.hand_name(env)).patches
    except ImportError:  # of a hand that is not installed, which is said where it is made
        return
    detection_of(noise, patches)


def lies(noise: Mapping[str, Any]) -> bool:
    """Say whether contacts may be another than are reported.

    Args:
        noise: keyword arguments of the environment, or of an observer; what it does not say is as usual.

    Returns:
        Whether there is any noise of contacts.
    """
    return any(noise.get(name, DEFAULTS[name]) != DEFAULTS[name] for name in CONTACTS)


def detection_of(noise: Mapping[str, Any], patches: Patches) -> sensors.ContactDetection:
    """Make the sensor of contacts.

    Args:
        noise: keyword arguments of the environment, or of an observer; what it does not say is as usual.
        patches: of the hand.

    Returns:
        The sensor.

    Raises:
        ValueError: for a value out of its range, and for patches that there are not.
    """
    miss, false_alarm, confusion, stuck, dead = (noise.get(name, DEFAULTS[name]) for name in CONTACTS)
    return sensors.ContactDetection(miss, false_alarm, confusion, stuck, dead, patches)


@dataclass(frozen=True)
class Condition:
    """What may vary in a sweep; the noises are the environment's keyword arguments.

    Attributes:
        sigma_deg: SD of the white noise of felt angles, degrees.
        bias_deg: SD of the constant offset of each joint, degrees.
        drift_deg: SD of the slow error of each joint, degrees.
        drift_seconds: time constant of the drift.
        proportional: SD of the noise as a fraction of the angle.
        motor_noise: SD as a fraction of the commanded torque.
        contact_miss: probability that a touch is not felt.
        contact_false_alarm: probability that one is felt that is none.
        contact_confusion: probability that one is felt at a neighbouring patch.
        patches_stuck: the patches that always report one, as `haptic_lab.faults` has it, or the probability of each.
        patches_dead: the patches that never do, likewise.
        policy: name, or path of a model.
        seconds: how long is explored.
        recording: path of the one that the hand repeats, which then is no policy's; "": none.
        condition: what people's table of trials calls it; "": nothing.

    Raises:
        ValueError: for a value out of its range.
    """

    sigma_deg: float
    bias_deg: float = _DEFAULTS["bias_deg"]
    drift_deg: float = _DEFAULTS["drift_deg"]
    drift_seconds: float = _DEFAULTS["drift_seconds"]
    proportional: float = _DEFAULTS["proportional"]
    motor_noise: float = _DEFAULTS["motor_noise"]
    contact_miss: float = _DEFAULTS["contact_miss"]
    contact_false_alarm: float = _DEFAULTS["contact_false_alarm"]
    contact_confusion: float = _DEFAULTS["contact_confusion"]
    patches_stuck: float | str = _DEFAULTS["patches_stuck"]
    patches_dead: float | str = _DEFAULTS["patches_dead"]
    policy: str = "random_torque"
    seconds: float = _DEFAULTS["episode_seconds"]
    recording: str = ""
    condition: str = ""

    def __post_init__(self) -> None:
        validate.number("--sigmas", self.sigma_deg, high=90.0, above=0.0, unit="degrees")
        check_noise(self.noise)
        if not self.recording:
            agents.find(self.policy, "--policy")
        validate.number("--seconds", self.seconds, 0.0, 3600.0, above=0.0, unit="s")

    @property
    def noise(self) -> dict[str, Any]:
        """Keyword arguments of the environment."""
        return {"sigma_deg": self.sigma_deg, **noise_of(self)}

    @property
    def values(self) -> tuple[float | str, ...]:
        """Of `FACTORS`, as a table has them: faults are text, numbers or not."""
        told = ((name, getattr(self, name)) for name in FACTORS)
        return tuple(str(value) if name in FAULTS else value for name, value in told)

    @property
    def named_by(self) -> dict[str, Any]:
        """Those of `FACTORS` that a file is named by: of `UNTOLD`, only what is not as usual."""
        told = {name: getattr(self, name) for name in FACTORS}
        return {name: value for name, value in told.items() if name not in UNTOLD or value != UNTOLD[name]}


FACTORS = tuple(each.name for each in fields(Condition))
NOISES = FACTORS[: FACTORS.index("policy")]
DEFAULTS = {name: _DEFAULTS[name] for name in NOISES if name != "sigma_deg"}
CONTACTS = tuple(name for name in NOISES if name.startswith(("contact_", "patches_")))
LATER = ("contact_confusion", *FAULTS)
# What tables have only where one is not as usual, as those from before.
UNTOLD: dict[str, Any] = {**{name: DEFAULTS[name] for name in LATER}, "recording": "", "condition": ""}
RECORDED = "recording"  # the policy of hands that repeat one


def factors_in(columns: Collection[str]) -> list[str]:
    """List the factors that a table tells of.

    Args:
        columns: of the table.

    Returns:
        Those of `FACTORS` that it has, in order.
    """
    return [name for name in FACTORS if name in columns]


def add_flags(add: Callable[..., Any], what: str, usual: str | None = None, **keywords: Any) -> None:
    """Let a command take the noise that there is, but sigma.

    Args:
        add: adds an argument to its parser.
        what: of each flag, for its help.
        usual: what it is by default, for its help; None: `DEFAULTS`.
        **keywords: of each flag; a `nargs` makes a list of its default.
    """
    for name, value in DEFAULTS.items():
        kind, said = (faults.as_faults, f"; {faults.HELP}") if name in FAULTS else (float, "")
        also = {**keywords, "default": [value]} if "nargs" in keywords else keywords
        add(f"--{name.replace('_', '-')}", type=kind, help=f"{what}{said} (default{usual or f' {value:g}'})", **also)
