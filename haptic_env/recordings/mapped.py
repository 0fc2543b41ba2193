"""What the columns of a file say, by their map: samples of a hand's joints and of what its patches felt.

Shapes: T samples, J joints, P patches, C columns. NaN: not measured.
"""

from __future__ import annotations

import numpy as np

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.recordings import checks
from haptic_env.recordings.column_map import Clock, ColumnMap, JointColumn
from haptic_env.recordings.merging import Samples, in_order
from haptic_env.recordings.streams import Stream, Streams, summary
from haptic_env.recordings.whose import whose


def joints_of(streams: Streams, columns: ColumnMap, hand: Hand) -> Samples:
    """Find the joints' angles.

    Args:
        streams: of the file.
        columns: what they mean.
        hand: whose joints they are.

    Returns:
        Samples of angles (T, J) rad, in the hand's order.

    Raises:
        ValueError: for a column that is not there, joints that the hand does not have or that are missing, and angles
            that no hand has.
    """
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
    missing = hand.couplings.without(hand.joint_names, lines)
    if missing:
        raise ValueError(
            f"{columns.source}: which column is {validate.few(missing)} of hand {hand.name!r}? Name one, or the angle "
            f"at which it stays, under [joints.columns]; {streams.source} has "
            f"{validate.few(summary(streams.columns))}{whose(streams.columns)}"
        )
    parts, scale, zero, names = [], [], [], []
    for name in (each for each in hand.joint_names if each in lines):
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
    angles = np.zeros((len(told), hand.joints))
    for j, name in enumerate(hand.joint_names):
        if name in names:
            at = names.index(name)
            angles[:, j] = scale[at] * (told.values[:, at] - zero[at])
        elif name in lines:
            angles[:, j] = lines[name].unit * lines[name].zero
    made = [name not in lines for name in hand.joint_names]  # followers
    angles = np.where(made, hand.couplings.follow(angles), angles)
    known = np.where(np.isfinite(angles), angles, hand.rest_pose)

    def when(sample: int) -> str:
        return f"{told.time[sample]:g} s"

    checks.angles(streams.source, "joint_angles", known, hand.joint_names, when)
    checks.reach(streams.source, known, hand)
    return Samples(told.time, angles, told.late, told.repeated)


def touch_of(streams: Streams, columns: ColumnMap, hand: Hand) -> tuple[Samples, list[int]]:
    """Find what was touched.

    Args:
        streams: of the file.
        columns: what they mean.
        hand: whose patches they are.

    Returns:
        Samples of contacts (T, M) of the M patches that are measured, and which these are.

    Raises:
        ValueError: for a column that is not there, taxels without a place, and pressures that are all zero.
    """
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
