"""What the columns of a stream mean to a hand: the same words as for files (`haptic_env.recordings.column_map`).

Shapes: T samples, C columns, J joints, P patches, M of them measured. NaN: not measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.coupling import Couplings
from haptic_env.hand import Hand
from haptic_env.recordings import ColumnMap, checks
from haptic_env.recordings.column_map import JointColumn
from haptic_env.recordings.streams import Stream, Streams, summary
from haptic_env.recordings.whose import whose

ROUNDED = 1e-6  # beyond ± 1: a fraction that was rounded


@dataclass(frozen=True)
class JointLayout:
    """How columns tell angles.

    Attributes:
        stream: that has them.
        column: (J,) of each joint; -1: it stays at its `zero`.
        scale: (J,) rad, of what a column says.
        zero: (J,) what it says where the angle is zero; of a joint that stays its angle, rad.
        limits: (2, J) rad, beyond which nothing is believed.
        couplings: of the joints.
        made: (J,) followers of which nothing is told: they are where their leaders put them.
    """

    stream: str
    column: NDArray[np.int64]
    scale: Array
    zero: Array
    limits: Array
    couplings: Couplings
    made: NDArray[np.bool_]

    def angles(self, values: Array) -> tuple[Array, int]:
        """Read samples.

        Args:
            values: (T, C).

        Returns:
            (T, J) rad, and how many were out of reach, and are NaN.
        """
        told = self.scale * (values[:, np.maximum(self.column, 0)] - self.zero)
        told = np.where(self.column < 0, self.zero, np.where(np.isfinite(told), told, np.nan))
        if self.made.any():
            told = np.where(self.made, self.couplings.follow(told), told)
        odd = (told < self.limits[0]) | (told > self.limits[1])
        return np.where(odd, np.nan, told), int(odd.sum())


@dataclass(frozen=True)
class TouchLayout:
    """How columns tell contacts.

    Attributes:
        stream: that has them.
        column: of each taxel.
        patch: of each taxel, which of the measured ones.
        measured: (M,) patches that have a taxel.
        threshold: above which a pressure is a contact; None: columns are 0 or 1.
    """

    stream: str
    column: NDArray[np.int64]
    patch: NDArray[np.int64]
    measured: NDArray[np.int64]
    threshold: float | None

    def contacts(self, values: Array) -> tuple[Array, int]:
        """Read samples.

        Args:
            values: (T, C).

        Returns:
            (T, M), 0 or 1, and how many were neither, where no threshold is told, and are NaN.
        """
        told = values[:, self.column]
        told, odd = np.where(np.isfinite(told), told, np.nan), 0
        if self.threshold is None:
            wrong = (told != 0.0) & (told != 1.0) & ~np.isnan(told)
            told, odd = np.where(wrong, np.nan, told), int(wrong.sum())
        else:
            told = np.where(np.isnan(told), np.nan, told > self.threshold)
        result = np.full((len(values), len(self.measured)), np.nan)
        if len(self.measured) == len(self.patch):  # a taxel each
            result[:, self.patch] = told
            return result, odd
        for column, patch in enumerate(self.patch):
            result[:, patch] = np.fmax(result[:, patch], told[:, column])  # where any of its taxels is touched
        return result, odd


@dataclass(frozen=True)
class TorqueLayout:
    """How columns tell what is commanded, as fractions of the joints' limits.

    Attributes:
        stream: that has them.
        column: (J,) of each joint.
    """

    stream: str
    column: NDArray[np.int64]

    def torques(self, values: Array) -> tuple[Array, int]:
        """Read samples.

        Args:
            values: (T, C).

        Returns:
            (T, J), and how many numbers were no fractions: where there is any the whole sample is NaN.
        """
        told: Array = values[:, self.column]
        wrong = ~np.less_equal(np.abs(told), 1.0 + ROUNDED)
        odd = wrong.any(axis=1, keepdims=True)
        return np.where(odd, np.nan, told.clip(-1.0, 1.0)), int((wrong & ~np.isnan(told)).sum())


def torque_layout(stream: str, labels: Sequence[str], hand: Hand) -> TorqueLayout:
    """Find joints among the columns of a stream of torques.

    Args:
        stream: its name.
        labels: of its columns: names of joints, in any order, or as many as there are joints, in their order.
        hand: whose they are.

    Returns:
        Which column is of which joint.

    Raises:
        ValueError: for a stream of another width, or of other joints.
    """
    names, labels = hand.joint_names, list(labels)
    if {*names} <= {*labels}:
        return TorqueLayout(stream, np.array([labels.index(name) for name in names]))
    if len(labels) == len(names) and not {*names} & {*labels}:
        return TorqueLayout(stream, np.arange(len(names)))
    missing = [name for name in names if name not in labels]
    raise ValueError(
        f"stream {stream!r} of torques has {len(labels)} columns; it must have one of each of the {len(names)} joints "
        f"of hand {hand.name!r}, called so or in their order; there is none of {validate.few(missing)}"
    )


def layouts(
    streams: Sequence[tuple[str, Sequence[str]]], columns: ColumnMap | None, hand: Hand
) -> tuple[JointLayout, TouchLayout]:
    """Find joints and patches among the columns of streams.

    Args:
        streams: their names, and the labels of their columns; where there are none that are the hand's own, a stream
            with as many columns as it has joints, or patches, has them in its order.
        columns: what they mean; None: they are called as joints and patches are.
        hand: whose they are.

    Returns:
        The joints', and the touch's.

    Raises:
        ValueError: for a stream of another width, columns that are not there, and joints and patches that are none.
    """
    source = ", ".join(name for name, _ in streams)
    there = Streams(source, [Stream(name, tuple(labels), np.zeros((1, len(labels)))) for name, labels in streams])
    told = _usual(there, hand) if columns is None else columns
    return _joints(there, told, hand), _touch(there, told, hand)


def _usual(there: Streams, hand: Hand) -> ColumnMap:
    """What columns mean where nobody says."""
    known = {*hand.joint_names, *hand.patches.names}
    unnamed = [stream for stream in there.streams if not known & {*stream.columns}]
    joints = next((each.name for each in unnamed if len(each.columns) == hand.joints), None)
    touch = next((each.name for each in unnamed if len(each.columns) == len(hand.patches)), None)
    named = [] if joints else [name for name in hand.joint_names if name in there.columns]
    if hand.couplings.without(hand.joint_names, named):
        named = []
    touched = [name for name in hand.patches.names if name in there.columns] if not touch else []
    if not (joints or named) or not (touch or touched):
        widths = ", ".join(f"{each.name!r} has {len(each.columns)}" for each in there.streams)
        raise ValueError(
            f"hand {hand.name!r} has {hand.joints} joints and {len(hand.patches)} patches: a stream must have as many "
            f"columns, or columns that are called so; {widths}; or say by --columns what they mean"
            f"{whose(there.columns)}"
        )
    return ColumnMap(
        there.source,
        {name: JointColumn(name) for name in named},
        {name: name for name in touched},
        joints_stream=joints,
        joints_order=hand.joint_names if joints else (),
        touch_stream=touch,
        touch_order=hand.patches.names if touch else (),
    )


def _ordered(there: Streams, what: str, name: str, order: Sequence[str]) -> list[tuple[str, int, str]]:
    """The columns of a stream that are named by their order: stream, column, name."""
    stream, every = there.find(what, name)
    if len(every) != len(order):
        raise ValueError(
            f"stream {name!r} has {len(every)} columns, but the map names {len(order)} in its order; give one for "
            "each, '' for what is none"
        )
    return [(stream.name, column, each) for column, each in zip(every, order, strict=True) if each]


def _one(source: str, what: str, names: set[str]) -> str:
    if len(names) != 1:
        raise ValueError(f"{source}: {what} must come from one stream, got {validate.listed(sorted(names)) or 'none'}")
    return names.pop()


def _joints(there: Streams, told: ColumnMap, hand: Hand) -> JointLayout:
    lines: dict[str, tuple[JointColumn, str | None, int]] = {}
    if told.joints_stream is not None:
        for stream, column, joint in _ordered(there, "of joints", told.joints_stream, told.joints_order):
            lines[joint] = told.joints.get(joint, JointColumn(None)), stream, column
    for joint, line in told.joints.items():
        if joint not in lines and line.column is not None:
            found, which = there.find(f"of joint {joint}", line.column)
            if len(which) != 1:
                raise ValueError(f"{told.source}: joint {joint} needs one column, but {line.column} has {len(which)}")
            lines[joint] = line, found.name, which[0]
        lines.setdefault(joint, (line, None, -1))
    for joint in lines:
        validate.choice(f"joint of hand {hand.name!r}", joint, hand.joint_names)
    missing = hand.couplings.without(hand.joint_names, lines)
    if missing:
        raise ValueError(
            f"{told.source}: which column is {validate.few(missing)} of hand {hand.name!r}? There are "
            f"{validate.few(summary(there.columns))}{whose(there.columns)}"
        )
    made = np.array([joint not in lines for joint in hand.joint_names])
    each = [lines.get(joint, (JointColumn(None), None, -1)) for joint in hand.joint_names]
    columns = np.array([at for *_, at in each])
    zero = np.array([line.zero * (1.0 if at >= 0 else line.unit) for line, _, at in each])
    scale = np.array([line.sign * line.unit for line, *_ in each])
    stream = _one(there.source, "joints", {name for _, name, _ in each if name is not None})
    beyond = checks.BEYOND
    limits = hand.joint_limits.T + [[-beyond], [beyond]]
    return JointLayout(stream, columns, scale, zero, limits, hand.couplings, made)


def _touch(there: Streams, told: ColumnMap, hand: Hand) -> TouchLayout:
    taxels: list[tuple[str, int, str]] = []
    if told.touch_stream is not None:
        taxels = _ordered(there, "of touch", told.touch_stream, told.touch_order)
    for taxel, patch in (told.taxels or {}).items():
        stream, which = there.find("of touch", taxel)
        taxels += [(stream.name, column, patch) for column in which]
    if not taxels and not told.taxels:
        for name in hand.patches.names:
            if name in there.columns:
                stream, which = there.find("of touch", name)
                taxels.append((stream.name, which[0], name))
    for _, _, patch in taxels:
        validate.choice(f"patch of hand {hand.name!r}", patch, hand.patches.names)
    if not taxels:
        raise ValueError(f"{told.source}: no column is a taxel; there are {validate.few(summary(there.columns))}")
    of_hand = np.array([hand.patches.names.index(patch) for *_, patch in taxels])
    measured = np.unique(of_hand)
    column = np.array([at for _, at, _ in taxels])
    return TouchLayout(
        _one(there.source, "touch", {name for name, *_ in taxels}),
        column,
        np.searchsorted(measured, of_hand),
        measured,
        told.threshold,
    )
