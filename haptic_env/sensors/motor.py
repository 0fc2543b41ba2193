"""Signal-dependent motor noise (Harris & Wolpert 1998, Nature 394, 780): its SD grows with the command."""

from __future__ import annotations

import numpy as np
from numba import types
from numpy.typing import ArrayLike, NDArray

from haptic_env import readable, validate
from haptic_env.compiled import GIVEN, inner
from haptic_env.sensors.gaussian import log_normal

LARGEST = 1e9  # of a torque, in any unit


class MotorNoise:
    """Torque = command · (1 + `fraction` · N(0, 1)), drawn once per joint and control step.

    References:
        Harris & Wolpert 1998, Nature 394, 780.
    """

    __repr__ = readable.line

    def __init__(self, fraction: float) -> None:
        """Check the fraction.

        Args:
            fraction: SD over command, in [0, 1]; 0 is the paper's.

        Raises:
            ValueError: for another one.
        """
        self.fraction = validate.number("motor_noise", fraction, 0.0, 1.0)

    def sd(self, command: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give the SD of the torque about a command.

        Args:
            command: (J,).

        Returns:
            (J,), in the unit of the command.
        """
        return self.fraction * np.abs(command)

    def sample(self, rng: np.random.Generator, command: NDArray[np.float64]) -> NDArray[np.float64]:
        """Draw the torque that the muscles really make of a command.

        Args:
            rng: gives the draws.
            command: (J,).

        Returns:
            (J,), in the unit of the command.
        """
        torque = rng.standard_normal(len(command))
        _disturb(command, self.fraction, torque)
        return torque

    def log_prob(self, torque: ArrayLike, command: ArrayLike) -> float:
        """Score a torque.

        Args:
            torque: (J,), the real one.
            command: (J,), in the same unit.

        Returns:
            The log density.

        Raises:
            ValueError: for other shapes, and what is not finite or beyond ± `LARGEST`.
        """
        real, told = validate.together(LARGEST, torque=torque, command=command)
        return log_normal(real, told, self.sd(told))


@inner(types.void(GIVEN, types.float64, types.float64[::1]))
def _disturb(command, fraction, normal):
    """Turn `normal` (J,), standard, into torques about `command` (J,): `sd` once more, but compiled."""
    for joint in range(len(command)):
        normal[joint] = command[joint] + fraction * abs(command[joint]) * normal[joint]
