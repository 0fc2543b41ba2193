"""What a stranger's file holds, before anything is said of what it means: streams of numbers, each with its own clock.

Shapes: T samples, C columns; K steps, J joints, P patches.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand

TIMES = ("time", "timestamp", "timestamps", "t")  # columns that are taken for the time where nothing is said
TORQUES = "commanded_torques"  # array (K, J) of an .npz that is read without a map
UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
MOST_NUMBERS = 2**26  # of a stream: 512 MiB
SLICE = re.compile(r"(?P<name>.+)\[(?P<first>\d+)(?::(?P<end>\d+))?\]")


@dataclass(frozen=True)
class Stream:
    """Numbers that come together.

    Attributes:
        name: of the stream; "" where a file has but one.
        columns: (C,) their names.
        values: (T, C); NaN where nothing was measured.
        time: (T,) s; None where a column has it.
    """

    name: str
    columns: tuple[str, ...]
    values: Array
    time: Array | None = None


def numbered(name: str, values: Array, time: Array | None = None) -> Stream:
    """Name the columns of an array by their numbers, `name[0]` and so on.

    Args:
        name: of the array.
        values: (T, ...) numbers; further dimensions are laid out in C order.
        time: (T,) s; None: told elsewhere.

    Returns:
        The stream.
    """
    flat = np.asarray(values, dtype=np.float64).reshape(len(values), -1)
    columns = (name,) if np.ndim(values) == 1 else tuple(f"{name}[{c}]" for c in range(flat.shape[1]))
    return Stream(name, columns, flat, time)


def arrays_of(
    hand: Hand, control_hz: float, joint_angles: Array, contacts: Array, torques: Array | None = None
) -> dict[str, Array]:
    """Name what a hand felt as files are read without a map.

    Args:
        hand: with J joints and P patches.
        control_hz: Hz, of the steps.
        joint_angles: (K, J) rad.
        contacts: (K, P), 0 or 1; NaN where nothing was measured.
        torques: (K, J) fractions, commanded on the way to each step; None: they are not known.

    Returns:
        `time` (K,) s from the first step, and (K,) for each joint, rad, and for each patch that was measured, by its
        name; where torques are known they are `commanded_torques`. `control_hz` tells the rate.
    """
    names = hand.patches.names
    return {
        "time": np.arange(len(joint_angles)) / control_hz,
        **dict(zip(hand.joint_names, joint_angles.T, strict=True)),
        **{names[patch]: contacts[:, patch] for patch in np.flatnonzero(np.isfinite(contacts).any(axis=0))},
        **({} if torques is None else {TORQUES: torques}),
        "control_hz": np.array(control_hz),
    }


class Streams:
    """The streams of a file, in which columns are found by name.

    Attributes:
        source: of the file, for messages.
        streams: that it holds.
    """

    def __init__(self, source: str, streams: Iterable[Stream]) -> None:
        """Take them.

        Args:
            source: of the file, for messages.
            streams: that it holds.

        Raises:
            ValueError: for a column that is there twice in a stream.
        """
        self.source, self.streams = source, tuple(streams)
        for stream in self.streams:
            twice = {name for name in stream.columns if stream.columns.count(name) > 1}
            if twice:
                raise ValueError(f"{source}: column {validate.listed(sorted(twice))} is there twice")

    @property
    def columns(self) -> list[str]:
        """Names of all columns, each told apart by its stream where another has the same."""
        every = [(stream, name) for stream in self.streams for name in stream.columns]
        names = [name for _, name in every]
        return [name if names.count(name) == 1 else f"{stream.name}/{name}" for stream, name in every]

    def find(self, what: str, name: str) -> tuple[Stream, list[int]]:
        """Find columns.

        Args:
            what: they are for, for messages.
            name: of one column, with its stream before a slash where others are called so too; of a whole stream; or
                of a part of it, `name[3]` or `name[3:9]`.

        Returns:
            The stream, and which of its columns.

        Raises:
            ValueError: where it is not there, or there are several.
        """
        found = [
            (stream, [stream.columns.index(column)])
            for stream in self.streams
            for column in stream.columns
            if name in (column, f"{stream.name}/{column}")
        ]
        if not found:
            found = [(stream, list(range(len(stream.columns)))) for stream in self.streams if stream.name == name]
        if not found and (part := SLICE.fullmatch(name)):
            for stream in self.streams:
                if stream.name == part["name"]:
                    first = int(part["first"])
                    end = int(part["end"] or first + 1)
                    if not first < end <= len(stream.columns):
                        raise ValueError(
                            f"{self.source}: column {what} {name} is not there; {stream.name} has {len(stream.columns)}"
                        )
                    found.append((stream, list(range(first, end))))
        if len(found) > 1:
            several = [f"{stream.name}/{name}" for stream, _ in found]
            raise ValueError(f"{self.source}: {what}: there are several {name!r}; say which: {', '.join(several)}")
        if not found:
            try:
                validate.choice(f"column {what}", name, summary(self.columns))
            except ValueError as error:
                raise ValueError(f"{self.source}: {error}") from error
        return found[0]

    def time_of(self, stream: Stream, column: str | None, unit: float | None, rate: float | None) -> Array:
        """Find when the samples of a stream were taken.

        Args:
            stream: of this file.
            column: that tells; None: one of `TIMES`.
            unit: s, of that column; None: 1.
            rate: Hz of steady samples, in place of stamps.

        Returns:
            (T,) s.

        Raises:
            ValueError: where nothing tells, or stamps are not finite.
        """
        if rate is not None:
            return np.arange(len(stream.values)) / rate
        if column is None and stream.time is not None:
            return stream.time * (1.0 if unit is None else unit)
        if column is None:
            known = [name for name in self.columns if name in TIMES]
            if not known:
                raise ValueError(
                    f"{self.source}: no column is called {', '.join(TIMES)}; say in the map which has the time "
                    f"([time] column = ..., or rate = ... Hz); there are {validate.few(summary(self.columns))}"
                )
            column = known[0]
        of, columns = self.find("of time", column)
        time = of.values[:, columns[0]] * (1.0 if unit is None else unit)
        if len(time) != len(stream.values):
            raise ValueError(
                f"{self.source}: cut short: {len(time)} time stamps in {column} and {len(stream.values)} samples of "
                f"{stream.name or 'the columns'}"
            )
        if not np.isfinite(time).all():
            raise ValueError(f"{self.source}: time stamp {int(np.argmin(np.isfinite(time)))} in {column} is not finite")
        return time


def summary(columns: Sequence[str]) -> list[str]:
    """Shorten a list of columns for a message: of `name[0]`, `name[1]`, ... the first and the last alone.

    Args:
        columns: their names.

    Returns:
        The names, some left out.
    """
    kept: list[str] = []
    for each, following in zip(columns, [*columns[1:], ""], strict=True):
        mine, theirs = SLICE.fullmatch(each), SLICE.fullmatch(following)
        first = mine is None or mine["first"] == "0"
        if first or theirs is None or mine is None or theirs["name"] != mine["name"]:
            kept.append(each)
    return kept
