"""Recordings at the control rate.

Shapes: T frames, J joints, K control steps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.recordings.recording import Recording, Track

SAME = 1e-4  # of a control step: stamps that near to it are those of the control rate, rounded
MOST_FRAMES = 1_000_000  # five hours at 50 Hz


def resample(recording: Recording, control_hz: float) -> Recording:
    """Give a recording the frames of a control rate.

    One that has them already keeps its numbers, bit for bit. Angles and places are interpolated by monotone cubics,
    which do not overshoot, turns by the shortest way.

    Args:
        recording: of any frames.
        control_hz: Hz.

    Returns:
        The recording with a frame every 1 / `control_hz` s from its first one on.

    Raises:
        ValueError: for what was felt at another rate, and for a recording that is shorter than a step, or that would
            have more than `MOST_FRAMES`.

    References:
        Fritsch & Carlson 1980, SIAM J. Numer. Anal. 17, 238-246.
    """
    rate = validate.number("control_hz", control_hz, above=0.0, unit="Hz")
    wanted = np.floor(recording.seconds * rate + SAME) + 1
    if not 2 <= wanted <= MOST_FRAMES:
        raise ValueError(
            f"{recording.source}: {recording.seconds:g} s at {rate:g} Hz are {wanted:g} frames; a recording must have "
            f"2 to {MOST_FRAMES}"
        )
    steps = int(wanted)
    time = np.arange(steps) / rate
    passed = recording.time - recording.time[0]
    if steps == len(recording) and np.abs(passed - time).max() < SAME / rate:
        return recording
    if recording.felt is not None:
        raise ValueError(
            f"{recording.source}: what was felt at one rate cannot be told at another; its own is "
            f"{1 / np.median(np.diff(passed)):g} Hz, got control_hz={rate:g}"
        )
    time = np.minimum(time, passed[-1])
    return replace(
        recording,
        time=recording.time[0] + time,
        joint_angles=_between(recording.joint_angles, passed, time),
        root=_moved(recording.root, passed, time),
        object=_moved(recording.object, passed, time),
    )


def _between(values: Array, passed: Array, time: Array) -> Array:
    """`values` (T, …), known at the times `passed` (T,), at `time` (K,)."""
    with np.errstate(over="ignore"):  # where next to nothing changes, the reciprocal of the slope may be infinite
        return PchipInterpolator(passed, values)(time)


def _moved(track: Track | None, passed: Array, time: Array) -> Track | None:
    """`track`, known at the times `passed` (T,), at `time` (K,)."""
    if track is None:
        return None
    turns = Slerp(passed, Rotation.from_quat(track.quaternion, scalar_first=True))(time)
    return Track(_between(track.position, passed, time), turns.as_quat(scalar_first=True))
