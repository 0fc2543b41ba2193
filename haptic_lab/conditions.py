"""What may vary from trial to trial within one table, besides the object and the seed."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import agents
from haptic_env import sensors, validate
from haptic_env.explore import ExploreEnv

TRUST = "run what a model.zip has in it, as you would run a program of whoever made it (docs/learning.md)"
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


def check_noise(noise: Mapping[str, Any]) -> None:
    """Check all noise but sigma.

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
        policy: name, or path of a model.
        seconds: how long is explored.

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
    policy: str = "random_torque"
    seconds: float = _DEFAULTS["episode_seconds"]

    def __post_init__(self) -> None:
        validate.number("--sigmas", self.sigma_deg, high=90.0, above=0.0, unit="degrees")
        check_noise(self.noise)
        agents.find(self.policy, "--policy")
        validate.number("--seconds", self.seconds, 0.0, 3600.0, above=0.0, unit="s")

    @property
    def noise(self) -> dict[str, Any]:
        """Keyword arguments of the environment."""
        return {name: getattr(self, name) for name in NOISES}


FACTORS = tuple(each.name for each in fields(Condition))
NOISES = FACTORS[: FACTORS.index("policy")]
DEFAULTS = {name: _DEFAULTS[name] for name in NOISES if name != "sigma_deg"}
