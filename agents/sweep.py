"""A sweep made by hand: fingers close, open and go from side to side, to a rhythm that drifts.

Shapes: E environments, J joints.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.finger_kinematics import FingerKinematics
from agents.policy import Policy, State
from haptic_env import hand_env, validate
from haptic_env.hand import Hand
from observer.wrappers.belief_observation import CLOCKS_HZ

DECISION = 0.1  # s for which torques are held


class _Roles(NamedTuple):
    """What each joint of a hand does in a sweep, (J,) each: whether it is an abductor, which is known by its name, 1 or
    -1, for fingers take turns, and its share of the strokes that curl fingers."""

    sideways: NDArray[np.bool_]
    side: NDArray[np.float64]
    curl: NDArray[np.float64]

    @classmethod
    def of(cls, hand: Hand) -> _Roles:
        return cls(
            np.array(["abduction" in name for name in hand.joint_names]),
            np.where(hand.joint_group % 2 == 0, 1.0, -1.0),
            FingerKinematics(hand).strokes(hand.rest_pose, hand.grasp_centre).curl.sum(axis=0),
        )


@dataclass(frozen=True)
class SweepingMotion:
    """Close and open the fingers at 1 Hz while they sweep sideways at 0.5 Hz, against each other, and drift at 0.17 Hz.

    The drift begins at nothing, so that the sweep begins as without it.

    Attributes:
        flexion: of flexors, a fraction of their torque limits.
        opening: ± so much about that.
        sideways: of abductors, ± so much.
        curl: of the drift, ± so much of the stroke that curls a finger (`agents.finger_kinematics`).

    Raises:
        ValueError: for a value out of its range.
    """

    flexion: float = 0.5
    opening: float = 0.5
    sideways: float = 1.0
    curl: float = -0.5

    def __post_init__(self) -> None:
        for name in ("flexion", "opening", "sideways", "curl"):
            validate.number(name, getattr(self, name), -10.0, 10.0)

    def torques(self, seconds: NDArray[np.float64], hand: Hand) -> NDArray[np.float32]:
        """Say what the sweep commands.

        Args:
            seconds: (E,) of an episode.
            hand: whose fingers sweep.

        Returns:
            (E, J) fractions, not yet clipped to -1 and 1, for that is no linear function of the clocks.
        """
        return self._commanded(seconds, _Roles.of(hand))

    def _commanded(self, seconds: NDArray[np.float64], roles: _Roles) -> NDArray[np.float32]:
        turn, beat, drift = (2 * np.pi * hz * seconds[:, None] for hz in CLOCKS_HZ)
        across = self.sideways * np.cos(turn) * roles.side
        close = self.flexion + self.opening * np.sin(beat) + self.curl * np.sin(drift) * roles.curl
        return np.where(roles.sideways, across, close).astype(np.float32)


class Sweep(Policy):
    """Commands a `SweepingMotion`, held for 0.1 s each; joints that move several fingers, as a wrist's, are left alone.

    It reads a clock and nothing else, leaves nothing to chance, and is what learners of the two-finger hand begin with.
    """

    blind = True
    remembers = ((),)

    def __init__(
        self,
        env: gym.Env[Any, Any],
        seed: int | None = None,
        *,
        flexion: float = SweepingMotion.flexion,
        opening: float = SweepingMotion.opening,
        sideways: float = SweepingMotion.sideways,
        curl: float = SweepingMotion.curl,
    ) -> None:
        """Find the fingers.

        Args:
            env: one environment, with a hand.
            seed: of no effect, since nothing is left to chance.
            flexion: of flexors, a fraction of their torque limits.
            opening: ± so much about that.
            sideways: of abductors, ± so much.
            curl: of the drift, ± so much of the stroke that curls a finger.

        Raises:
            ValueError: for a value out of range.
        """
        super().__init__(env, seed)
        base = hand_env(env)
        self._roles, self._step_seconds = _Roles.of(base.hand), 1.0 / base.control_hz
        self._hold = max(1, round(DECISION * base.control_hz))
        self._alone = FingerKinematics(base.hand).alone.any(axis=0)
        self._motion = SweepingMotion(flexion, opening, sideways, curl)

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """Command what the clock says.

        Args:
            observation: of one environment, which is not read.
            state: steps of the episode.
            deterministic: of no effect.

        Returns:
            Action (J,), and the next state.
        """
        step = 0 if state is None else int(state[0])
        seconds = np.array([step // self._hold * self._hold * self._step_seconds])
        torque = np.clip(self._motion._commanded(seconds, self._roles)[0], -1.0, 1.0)
        return np.where(self._alone, torque, np.float32(0.0)), (np.array(step + 1),)
