"""Sensor and motor models: the noise q̃ = q + ε of the paper (section 3), and what real senses and muscles add.

The environment draws from each by `sample`. `log_prob` scores what was drawn, for whoever compares these models with
data: the observer has its own model of the noise, and is told numbers alone (`sigma_deg`, …); the two may differ.
"""

from haptic_env.sensors.contact import ContactDetection
from haptic_env.sensors.motor import MotorNoise
from haptic_env.sensors.proprioception import Bias, Drift, FeltAngles, Proportional, Proprioception, White

__all__ = ["Bias", "ContactDetection", "Drift", "FeltAngles", "MotorNoise", "Proportional", "Proprioception", "White"]
