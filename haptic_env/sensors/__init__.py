"""Sensor and motor models: the noise q̃ = q + ε of the paper (section 3), and what real senses and muscles add.

The environment draws from each by `sample`; `log_prob` scores what was drawn. The observer is told of the same models
by the same keywords (`sigma_deg`, `bias_deg`, …), and what it is told may differ from what is so.
"""

from haptic_env.sensors.contact import ContactDetection, Faults
from haptic_env.sensors.felt_angles import FeltAngles
from haptic_env.sensors.motor import MotorNoise
from haptic_env.sensors.proprioception import (
    Bias,
    Drift,
    Lasting,
    Proportional,
    Proprioception,
    Spread,
    White,
)

KEYWORDS = (
    "sigma_deg", "bias_deg", "drift_deg", "drift_seconds", "proportional", "motor_noise",
    "contact_miss", "contact_false_alarm", "contact_confusion", "patches_stuck", "patches_dead",
)  # fmt: skip

__all__ = [
    "KEYWORDS",
    "Bias",
    "ContactDetection",
    "Drift",
    "Faults",
    "FeltAngles",
    "Lasting",
    "MotorNoise",
    "Proportional",
    "Proprioception",
    "Spread",
    "White",
]
