"""Sensor and motor models: each one samples for the environment and scores for the observer."""

from haptic_env.sensors.contact import ContactDetection
from haptic_env.sensors.motor import MotorNoise
from haptic_env.sensors.proprioception import Bias, Drift, FeltAngles, Proportional, Proprioception, White

__all__ = ["Bias", "ContactDetection", "Drift", "FeltAngles", "MotorNoise", "Proportional", "Proprioception", "White"]
