"""A sweep that was made by hand, which a learner copies before it learns.

Shapes: E environments, J joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.finger_kinematics import FingerKinematics
from haptic_env import validate
from haptic_env.hand import Hand
from observer.wrappers.belief_observation import CLOCKS_HZ


@dataclass(frozen=True)
class SweepingMotion:
    """Close and open the fingers at 1 Hz while they sweep sideways at 0.5 Hz, against each other, and drift at 0.17 Hz.

    The drift begins at nothing, so that the sweep begins as without it.

    Attributes:
        flexion: of flexors, a fraction of their torque limits.
        opening: ± so much about that.
        sideways: of abductors, ± so much.
        curl: of the drift, ± so much of the stroke that curls a finger (`agents.finger_kinematics`).
        noise: SD of what is added while it is copied, so that it is seen what to do beside its path.
        decisions: of each environment that are copied.
        epochs: of the fit.

    Raises:
        ValueError: for a value out of its range.
    """

    flexion: float = 0.5
    opening: float = 0.5
    sideways: float = 1.0
    curl: float = -0.5
    noise: float = 0.3
    decisions: int = 150
    epochs: int = 60

    def __post_init__(self) -> None:
        for name in ("flexion", "opening", "sideways", "curl"):
            validate.number(name, getattr(self, name), -10.0, 10.0)
        validate.number("noise", self.noise, 0.0, 10.0)
        validate.integer("decisions", self.decisions, 1, 1_000_000)
        validate.integer("epochs", self.epochs, 0, 1_000_000)

    def torques(self, seconds: NDArray[np.float64], hand: Hand) -> NDArray[np.float32]:
        """Say what the sweep commands; abductors are known by their names, and fingers take turns.

        Args:
            seconds: (E,) of an episode.
            hand: whose fingers sweep.

        Returns:
            (E, J) fractions, not yet clipped to -1 and 1, for that is no linear function of the clocks.
        """
        sideways = np.array(["abduction" in name for name in hand.joint_names])
        curl = FingerKinematics(hand).strokes(hand.rest_pose, hand.grasp_centre).curl.sum(axis=0)
        side = np.where(hand.joint_group % 2 == 0, 1.0, -1.0)
        turn, beat, drift = (2 * np.pi * hz * seconds[:, None] for hz in CLOCKS_HZ)
        across = self.sideways * np.cos(turn) * side
        close = self.flexion + self.opening * np.sin(beat) + self.curl * np.sin(drift) * curl
        return np.where(sideways, across, close).astype(np.float32)
