"""A recording with measured touch: joints and contacts of a hand on the steps of an observer, and what was lost.

Shapes: K steps, J joints, P patches, T samples. NaN: not measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.recordings import checks
from haptic_env.recordings.column_map import Clock, ColumnMap, JointColumn
from haptic_env.recordings.merging import Samples, angles_at, contacts_at, in_order, longest_run
from haptic_env.recordings.resampling import MOST_FRAMES
from haptic_env.recordings.streams import Stream, Streams, arrays_of, summary
from haptic_env.recordings.whose import whose

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

    def __len__(self) -> int:
        return len(self.joint_angles)

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return (len(self) - 1) / self.control_hz

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
    joints = _joints(streams, columns, hand)
    touch, measured = _touch(streams, columns, hand)
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
    some_joint, no_touch = np.any(np.isnan(angles), axis=1), np.all(np.isnan(contacts), axis=1)
    coverage = Coverage(
        len(steps),
        rate,
        float(np.isnan(angles).mean()),
        float(np.isnan(contacts[:, measured]).mean()),
        len(measured),
        max(longest_run(some_joint), longest_run(no_touch)) / rate,
        max(joints.late, touch.late),
        max(joints.repeated, touch.repeated),
    )
    return MeasuredTouch(source, hand, rate, angles, contacts, coverage)


def _samples(streams: Streams, what: str, clock: Clock, parts: list[tuple[Stream, list[int]]]) -> Samples:
    """The columns of `parts` side by side, which must come from one stream."""
    stream = parts[0][0]
    for other, _ in parts:
        if other is not stream and (other.time is not None or len(other.values) != len(stream.values)):
            raise ValueError(
                f"{streams.source}: {what} must come together, but {other.name!r} has {len(other.values)} samples of "
                f"its own and {stream.name!r} {len(stream.values)}"
            )
    values = np.hstack([each.values[:, columns] for each, columns in parts])
    values = np.where(np.isfinite(values), values, np.nan)
    time = streams.time_of(stream, clock.column, clock.unit, clock.rate)
    if not np.isfinite(values).any():
        raise ValueError(f"{streams.source}: {what} hold no number")
    found = in_order(streams.source, what, time, values).known()
    if len(found) < 2:
        raise ValueError(f"{streams.source}: {what} need two samples, got {len(found)}")
    return found


def _joints(streams: Streams, columns: ColumnMap, hand: Hand) -> Samples:
    """Angles (T, J) rad, in the hand's order."""
    lines = dict(columns.joints)
    if columns.joints_stream is not None:
        stream, every = streams.find("of joints", columns.joints_stream)
        _width(streams, stream, every, columns.joints_order, "joints")
        for column, joint in zip(every, columns.joints_order, strict=True):
            if joint:
                unit = lines.get(joint, JointColumn(None))
                lines[joint] = unit._replace(column=stream.columns[column])
    if not lines:
        lines = {name: JointColumn(name) for name in hand.joint_names if name in streams.columns}
    for name in lines:
        try:
            validate.choice(f"joint of hand {hand.name!r}", name, hand.joint_names)
        except ValueError as error:
            raise ValueError(f"{columns.source}: {error}{whose(lines)}") from error
    missing = [name for name in hand.joint_names if name not in lines]
    if missing:
        raise ValueError(
            f"{columns.source}: which column is {validate.few(missing)} of hand {hand.name!r}? Name one, or the angle "
            f"at which it stays, under [joints.columns]; {streams.source} has "
            f"{validate.few(summary(streams.columns))}{whose(streams.columns)}"
        )
    parts, scale, zero, names = [], [], [], []
    for name in hand.joint_names:
        line = lines[name]
        if line.column is not None:
            of, which = streams.find(f"of joint {name}", line.column)
            if len(which) != 1:
                raise ValueError(f"{columns.source}: joint {name} needs one column, but {line.column} has {len(which)}")
            parts.append((of, which))
            scale.append(line.sign * line.unit)
            zero.append(line.zero)
            names.append(name)
    if not parts:
        raise ValueError(f"{columns.source}: no joint has a column")
    told = _samples(streams, "joints", columns.joints_clock, parts)
    angles = np.empty((len(told), hand.joints))
    for j, name in enumerate(hand.joint_names):
        if name in names:
            at = names.index(name)
            angles[:, j] = scale[at] * (told.values[:, at] - zero[at])
        else:
            angles[:, j] = lines[name].unit * lines[name].zero
    known = np.where(np.isfinite(angles), angles, hand.rest_pose)

    def when(sample: int) -> str:
        return f"{told.time[sample]:g} s"

    checks.angles(streams.source, "joint_angles", known, hand.joint_names, when)
    checks.reach(streams.source, known, hand)
    return Samples(told.time, angles, told.late, told.repeated)


def _touch(streams: Streams, columns: ColumnMap, hand: Hand) -> tuple[Samples, list[int]]:
    """Contacts (T, M) of the M patches that are measured, and which these are."""
    taxels = dict(columns.taxels)
    if columns.touch_stream is not None:
        stream, every = streams.find("of touch", columns.touch_stream)
        _width(streams, stream, every, columns.touch_order, "taxels")
        taxels |= {
            f"{stream.name}/{stream.columns[c]}": p for c, p in zip(every, columns.touch_order, strict=True) if p
        }
    if not taxels:
        taxels = {name: name for name in hand.patches.names if name in streams.columns}
    if not taxels:
        raise ValueError(
            f"{columns.source}: no column is a taxel; say under [touch.taxels] which patch each is at; "
            f"{streams.source} has {validate.few(summary(streams.columns))}"
        )
    parts, patches = [], []
    for taxel, patch in taxels.items():
        of, which = streams.find("of touch", taxel)
        try:
            validate.choice(f"patch of taxel {taxel!r}", patch, hand.patches.names)
        except ValueError as error:
            raise ValueError(f"{columns.source}: {error}") from error
        parts.append((of, which))
        patches += [hand.patches.names.index(patch)] * len(which)
    told = _samples(streams, "taxels", columns.touch_clock, parts)
    contact = _contacts(streams.source, told.values, columns.threshold)
    measured = sorted(set(patches))
    result = np.full((len(told), len(measured)), np.nan)
    for column, of_patch in enumerate(patches):
        at = measured.index(of_patch)
        result[:, at] = np.fmax(result[:, at], contact[:, column])  # a patch is touched where any of its taxels is
    return Samples(told.time, result, told.late, told.repeated), measured


def _contacts(source: str, values: Array, threshold: float | None) -> Array:
    """Contacts (T, C), NaN where nothing was measured, of pressures or of contacts."""
    known = values[np.isfinite(values)]
    if threshold is None:
        wrong = ~np.isin(known, (0.0, 1.0))
        if wrong.any():
            raise ValueError(
                f"{source}: contacts must be 0 or 1, got {known[wrong][0]:g}; of pressures say the threshold under "
                f"[touch], in ({known.min():g}, {known.max():g})"
            )
        return values
    if not known.any():
        raise ValueError(f"{source}: the pressures are all zero: nothing was measured, or other columns have them")
    if known.max() <= threshold:
        raise ValueError(
            f"{source}: no pressure is above the threshold of {threshold:g}; they lie in [{known.min():g}, "
            f"{known.max():g}]"
        )
    return np.where(np.isnan(values), np.nan, values > threshold)


def _width(streams: Streams, stream: Stream, columns: list[int], order: tuple[str, ...], what: str) -> None:
    if len(columns) != len(order):
        raise ValueError(
            f"{streams.source}: {stream.name or 'the file'} has {len(columns)} columns, but the map names {len(order)} "
            f"{what} in its order; give one for each, '' for what is none"
        )
