"""Sensor and motor models: the noise q̃ = q + ε of the paper (section 3), and what real senses and muscles add.

The environment draws from each by `sample`; `log_prob` scores what was drawn. The observer is told of the same models
by the same keywords (`sigma_deg`, `bias_deg`, …), and what it is told may differ from what is so.
"""

from haptic_env.sensors.contact import ContactDetection
from haptic_env.sensors.motor import MotorNoise
from haptic_env.sensors.proprioception import Bias, Drift, FeltAngles, Lasting, Proportional, Proprioception, White

__all__ = [
    "Bias",
    "ContactDetection",
    "Drift",
    "FeltAngles",
    "Lasting",
    "MotorNoise",
    "Proportional",
    "Proprioception",
    "White",
]
