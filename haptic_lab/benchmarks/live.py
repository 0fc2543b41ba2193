"""How long a step of `haptic-slam live` takes, from when its samples have come to when the belief is there."""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from haptic_lab import replay
from haptic_lab.benchmarks.end_to_end import clock
from haptic_lab.benchmarks.recording import BenchRecording
from haptic_lab.exploration.settings import DEFAULTS, ExplorationSettings
from haptic_lab.live.layout import layouts
from haptic_lab.live.record import StepRecord
from haptic_lab.live.session import Chunk, LiveSession
from observer import HapticSLAM

HZ = 100.0


def session_of(recording: BenchRecording, env_id: str, particles: int) -> LiveSession:
    """Make a session as the command does.

    Args:
        recording: of whose hand.
        env_id: registered, such as "HapticSLAM/MyoHand-v0".
        particles: N.

    Returns:
        The session, of steps at `HZ`.
    """
    hand = recording.hand
    about = {"env": env_id, "sigma": recording.sigma_deg, "seconds": None, "policy": "random_torque", "out": "out"}
    namer, _, told = replay.of_measured(ExplorationSettings(**{**DEFAULTS, **about}), hand)
    slam = HapticSLAM(hand, recording.sigma_deg, particles, control_hz=HZ, **told)
    found = layouts([("joints", hand.joint_names), ("touch", hand.patches.names)], None, hand)
    record = StepRecord(None, hand, HZ)
    return LiveSession(slam, namer, (*found, None), (1.0 / HZ, 1.0 / HZ), 0, record, lambda told: None)


def live_steps(recording: BenchRecording, env_id: str, particles: int) -> Array:
    """Time a session that is told a recording sample by sample, as if it had been taken at `HZ`.

    Args:
        recording: what was felt.
        env_id: of its hand.
        particles: N.

    Returns:
        (T,) s.
    """
    session = session_of(recording, env_id, particles)
    time, took = np.arange(len(recording.felt)) / HZ, []
    for k in range(len(time)):
        one = slice(k, k + 1)
        start = clock()
        for stream, values in (("joints", recording.felt), ("touch", recording.contacts)):
            session.take(Chunk(stream, time[one], values[one].astype(np.float64)), time[k])
        for step in session.merger.ready(time[k]):
            session.observe(step, [])
        took.append(clock() - start)
    return np.array(took)
