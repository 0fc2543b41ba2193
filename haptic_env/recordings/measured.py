"""A recording with measured touch: joints and contacts of a hand on the steps of an observer, and what was lost.

Shapes: K steps, J joints, P patches, T samples. NaN: not measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from haptic_env import readable, validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.recordings.column_map import ColumnMap
from haptic_env.recordings.mapped import joints_of, touch_of
from haptic_env.recordings.merging import angles_at, contacts_at, longest_run
from haptic_env.recordings.resampling import MOST_FRAMES
from haptic_env.recordings.streams import Streams, arrays_of

SLOWEST = 1.5  # s, usually, from one sample of joints to the next: more is not bridged by steps of a second
USUAL_HZ = 50.0  # Hz, of the steps, where joints come at least as often


class Coverage(NamedTuple):
    """How much of a recording was measured.

    Attributes:
        steps: K.
        control_hz: Hz.
        joints_missing: share of the joints' angles that were not measured.
        touch_missing: share of the contacts that were not measured, of patches that are measured at all.
        patches_measured: how many patches are.
        longest_gap: s, without the angle of some joint, or without any touch.
        late: samples that came after one that was taken later, of joints or of touch, whichever has more.
        repeated: samples with the time stamp of another, left out; likewise.
    """

    steps: int
    control_hz: float
    joints_missing: float
    touch_missing: float
    patches_measured: int
    longest_gap: float
    late: int
    repeated: int

    @classmethod
    def of(cls, angles: Array, contacts: Array, patches: int, rate: float, late: int, repeated: int) -> Coverage:
        """Tell how much was measured.

        Args:
            angles: (K, J) rad, NaN where they were not.
            contacts: (K, P), likewise.
            patches: how many are measured at all.
            rate: Hz, of the steps.
            late: as the attribute.
            repeated: as the attribute.

        Returns:
            What is told of it.
        """
        some_joint, touch = np.any(np.isnan(angles), axis=1), np.isfinite(contacts)
        longest = max(longest_run(some_joint), longest_run(np.logical_not(touch.any(axis=1)))) / rate
        missing = 1.0 - touch.sum() / max(len(angles) * patches, 1)
        return cls(len(angles), rate, float(np.isnan(angles).mean()), float(missing), patches, longest, late, repeated)

    def __str__(self) -> str:
        told = (
            f"{self.steps} steps at {self.control_hz:g} Hz; not measured: {self.joints_missing:.1%} of the joint "
            f"angles, {self.touch_missing:.1%} of the contacts of {self.patches_measured} patches"
        )
        if self.longest_gap:
            told += f"; the longest gap is {self.longest_gap:.2f} s"
        if self.late or self.repeated:
            told += f"; {self.late} samples came late, {self.repeated} twice"
        return told


@dataclass(frozen=True, eq=False)
class MeasuredTouch:
    """What a real hand felt.

    Attributes:
        source: where it comes from, for messages.
        hand: whose joints and patches they are.
        control_hz: Hz.
        joint_angles: (K, J) rad; of the first step all are known.
        contacts: (K, P), 0 or 1.
        coverage: what of it was measured.
        torques: (K, J) fractions, commanded on the way to each step; None: they are not known.
    """

    source: str
    hand: Hand
    control_hz: float
    joint_angles: Array
    contacts: Array
    coverage: Coverage
    torques: Array | None = None

    __repr__ = readable.line

    def __len__(self) -> int:
        return len(self.joint_angles)

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return (len(self) - 1) / self.control_hz

    def until(self, seconds: float | None) -> MeasuredTouch:
        """Leave out what comes late.

        Args:
            seconds: s, of what is kept, from its beginning; None: all is.

        Returns:
            The recording, of two steps at least.
        """
        steps = len(self) if seconds is None else min(max(round(seconds * self.control_hz), 1) + 1, len(self))
        if steps == len(self):
            return self
        angles, contacts, whole = self.joint_angles[:steps], self.contacts[:steps], self.coverage
        told = whole.patches_measured, self.control_hz, whole.late, whole.repeated
        torques = None if self.torques is None else self.torques[:steps]
        kept = replace(self, joint_angles=angles, contacts=contacts, torques=torques)
        return replace(kept, coverage=Coverage.of(angles, contacts, *told))

    def streams(self) -> dict[str, Array]:
        """Give it as arrays that `read_measured` reads without a map.

        Returns:
            As `streams.arrays_of`.
        """
        return arrays_of(self.hand, self.control_hz, self.joint_angles, self.contacts, self.torques)


def merge(streams: Streams, columns: ColumnMap, hand: Hand, *, stepped: bool = False) -> MeasuredTouch:
    """Make a recording of a file's streams: joints and touch are merged by time onto steps.

    Args:
        streams: of the file.
        columns: what they mean.
        hand: whose joints and patches they are.
        stepped: whether the file has a line for each step, as it was told to an observer: then what a line does not
            have was not measured, up to the last `time`.

    Returns:
        The recording; it begins where all joints were measured first.

    Raises:
        ValueError: for a column that is not there, joints that the hand does not have or that are missing, taxels
            without a place, streams of another width, time that runs back, angles that no hand has, and pressures
            that are all zero.
    """
    source = streams.source
    joints = joints_of(streams, columns, hand)
    touch, measured = touch_of(streams, columns, hand)
    if joints.interval > SLOWEST:
        told = f"{source}: joints come every {joints.interval:g} s, they must at least every {SLOWEST:g} s"
        raise ValueError(f'{told}; are these milliseconds? [time] unit = "ms"')
    rate = columns.control_hz
    if rate is None:
        rate = float(np.clip(round(1.0 / joints.interval, 3), 1.0, USUAL_HZ))
    start, end = joints.time[0], joints.time[-1]
    if stepped:
        stream, (column,) = streams.find("of time", "time")
        end = float(stream.values[:, column].max())
    if touch.time[-1] < start or touch.time[0] > end:
        raise ValueError(
            f"{source}: joints come from {start:g} to {end:g} s, touch from {touch.time[0]:g} to {touch.time[-1]:g} s: "
            "they share no time"
        )
    count = int(np.floor((end - start) * rate + 1e-4)) + 1
    if not 2 <= count <= MOST_FRAMES:
        raise ValueError(
            f"{source}: {end - start:g} s at {rate:g} Hz are {count} steps; there must be 2 to {MOST_FRAMES}"
        )
    steps = start + np.arange(count) / rate
    angles = angles_at(joints, steps)
    whole = np.all(np.isfinite(angles), axis=1)
    if whole[:-1].sum() == 0:
        never = [name for name, column in zip(hand.joint_names, angles.T, strict=True) if not np.isfinite(column).any()]
        what = f"joint {validate.listed(never)} is never measured" if never else "never are all joints measured at once"
        raise ValueError(f"{source}: {what}; an exploration begins where all are")
    first = int(np.argmax(whole))
    steps, angles = steps[first:], angles[first:]
    contacts = np.full((len(steps), len(hand.patches)), np.nan)
    contacts[:, measured] = contacts_at(touch, steps, interval=1.0 / rate if stepped else None)
    counted = max(joints.late, touch.late), max(joints.repeated, touch.repeated)
    coverage = Coverage.of(angles, contacts, len(measured), rate, *counted)
    return MeasuredTouch(source, hand, rate, angles, contacts, coverage)
