"""Joint servos that let the hand repeat a recording, as a person's muscles do: by command first, by feeling second.

Shapes: T frames, J joints. Angles in radians, torques as fractions of their limits.

The command is the torque that moves the hand along the recording in free air (inverse dynamics); what is felt corrects
it, with a filter against the noise. An object in the way is thus pressed, not pierced.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.policy import Policy, State
from haptic_env import hand_env, validate
from haptic_env.arrays import Array
from haptic_env.recordings import Recording, resample

FASTEST = 6.0  # Hz: people move no faster (Winter 2009, Biomechanics and Motor Control of Human Movement, section 3.4)
LEAD_SECONDS = 0.5  # from the rest pose to where the recording begins
STIFFEST = 1e6
SENSE_SECONDS = 0.06  # over which felt angles are averaged


class FollowRecording(Policy):
    """Repeats `recording`; after its end the hand is held where it ended."""

    def __init__(
        self,
        env: gym.Env[Any, Any],
        recording: Recording,
        *,
        stiffness: float = 1.0,
    ) -> None:
        """Match the recording to the hand of `env`.

        Args:
            env: with a hand.
            recording: joint angles of that hand.
            stiffness: part of the torque limit with which a joint answers an error of 1 rad.

        Raises:
            ValueError: where the recording lacks joints of the hand, has others, or angles that no hand has.
        """
        super().__init__(env)
        base = hand_env(env)
        hand, rate = base.hand, float(base.control_hz)
        self.stiffness = validate.number("stiffness", stiffness, 0.0, STIFFEST)
        recording.angles_of(hand)  # before it has other frames, which no error should tell of
        angles = _smooth(resample(recording, rate).angles_of(hand), rate)
        low, high = hand.joint_limits.T
        self.reference = _led_in(hand.rest_pose, np.clip(angles, low, high), rate)
        self.command = hand.torques_along(self.reference, rate) / hand.torque_limits
        self.steps = len(self.reference) - 1
        self.remembers = ((), (self.joints,))
        self._keep = float(np.exp(-1.0 / (rate * SENSE_SECONDS)))

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        felt = np.asarray(observation["joint_angles"], dtype=np.float64)
        if state is None:
            step, error = 0, np.zeros(self.joints)
        else:
            step, error = int(state[0]), state[1]
        error = self._keep * error + (1.0 - self._keep) * (self.reference[min(step, self.steps)] - felt)
        torque = self.command[min(step, self.steps)] + self.stiffness * error
        return np.clip(torque, -1.0, 1.0).astype(np.float32), (np.array(step + 1), error)


def _smooth(angles: Array, rate: float) -> Array:
    """Without what is faster than people move, and without delay."""
    if rate <= 2.0 * FASTEST or len(angles) < 20:
        return angles
    from scipy.signal import butter, sosfiltfilt  # which takes a quarter of a second to import

    return np.asarray(sosfiltfilt(butter(2, FASTEST, fs=rate, output="sos"), angles, axis=0))


def _led_in(rest: Array, angles: Array, rate: float) -> Array:
    """`angles` (T, J) with a way before them from `rest` (J,) that starts and ends still (Flash & Hogan 1985)."""
    share = np.linspace(0.0, 1.0, max(2, round(LEAD_SECONDS * rate)), endpoint=False)[:, None]
    way = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return np.concatenate([rest + way * (angles[0] - rest), angles])
