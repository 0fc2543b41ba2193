"""What a recording may say: numbers of a hand that moves, in seconds, radians and metres.

Shapes: T frames, J joints. Every error names the source, what is wrong at which frame, and what is valid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.sensors import FeltAngles

Where = Callable[[int], str]
LATEST = 1e10  # s: a clock that counts from 1970 is at 1.8e9 in seconds, at 1.8e12 in milliseconds
SHORTEST = 1e-6  # s between frames
LARGEST_ANGLE = FeltAngles.BOUND * (1 + 1e-6)  # rad, of what may be felt; the bound itself is a rounded number there
LEAP = 1.5 * np.pi  # rad between frames: less than a turn, more than any joint has
BEYOND = 0.5 * np.pi  # rad beyond a joint's limits: what is fitted to markers goes beyond them by up to 1.07
FARTHEST = 100.0  # m: a place in the room of a motion capture
APART = 5.0  # m between the hand and what it explores
ROUNDED = 0.01  # by which the length of a quaternion may differ from 1
MOST_JOINTS = 1000
UNIT = "angles are radians; are these degrees?"
METRES = "places are metres; are these millimetres?"


def frame_number(frame: int) -> str:
    """Say where a frame is, in a file that has no lines.

    Args:
        frame: from 0.

    Returns:
        As an error says it.
    """
    return f"frame {frame}"


def plain(source: str, what: str, value: ArrayLike) -> NDArray[Any]:
    """Take `value` for an array of real numbers.

    Args:
        source: of the recording, for messages.
        what: `value` is, for messages.
        value: what may be an array.

    Returns:
        The array.

    Raises:
        ValueError: where it is none, or some are masked.
    """
    if isinstance(value, np.ma.MaskedArray):
        raise ValueError(f"{source}: {what} must be numbers, got a masked array; fill what is masked, or leave it out")
    result = validate.real(value)
    if result is None:
        got = value.dtype if isinstance(value, np.ndarray) else validate.shown(value)
        raise ValueError(f"{source}: {what} must be numbers, got {got}")
    return result


def numbers(source: str, what: str, value: ArrayLike, shape: tuple[int, ...], columns: Sequence[str] = ()) -> Array:
    """Take `value` for finite numbers.

    Args:
        source: of the recording, for messages.
        what: `value` is, for messages.
        value: what may be an array.
        shape: that it must have; frames first.
        columns: names of its columns, for messages.

    Returns:
        The numbers as float64, of `shape`.

    Raises:
        ValueError: for another shape, or that names the first frame that is not finite.
    """
    given = plain(source, what, value)
    if given.shape != shape:
        raise ValueError(f"{source}: {what} must have shape {shape}, got {given.shape}")
    with np.errstate(over="ignore"):  # of longer numbers, which become infinite
        result = np.asarray(given, dtype=np.float64)
    _refuse(source, what, result, ~np.isfinite(result), columns, "which is not finite")
    return result


def names(source: str, value: Sequence[str]) -> tuple[str, ...]:
    """Take `value` for the names of joints.

    Args:
        source: of the recording, for messages.
        value: texts.

    Returns:
        The names (J,).

    Raises:
        ValueError: for none, too many, the same ones, or what is no text.
    """
    several = isinstance(value, Sequence) and not isinstance(value, str)
    if not several or not all(isinstance(name, str) for name in value):
        raise ValueError(f"{source}: joint_names must be text, got {validate.shown(value)}")
    if not 1 <= len(value) <= MOST_JOINTS:
        raise ValueError(f"{source}: joint_names must be 1 to {MOST_JOINTS} names, got {len(value)}")
    twice = sorted({name for name in value if list(value).count(name) > 1})
    if twice:
        raise ValueError(f"{source}: joint {validate.listed(twice)} is named twice")
    return tuple(value)


def times(source: str, time: Array, largest_gap: float, where: Where = frame_number) -> None:
    """Check the stamps of frames.

    Args:
        source: of the recording, for messages.
        time: (T,) s.
        largest_gap: s, between two frames.
        where: says where a frame is.

    Raises:
        ValueError: where time is repeated, runs back, or leaps by more than `largest_gap`.
    """
    steps = np.diff(time)
    for wrong, told in (
        (steps == 0, "repeats the time stamp before it"),
        (steps < 0, "lies before the one before it in time"),
        (steps < SHORTEST, f"comes less than {SHORTEST:g} s after the one before it"),
        (steps > largest_gap, f"comes after a gap of more than {largest_gap:g} s"),
    ):
        if wrong.any():
            frame = int(np.argmax(wrong))
            raise ValueError(f"{source}: {where(frame + 1)} {told} ({time[frame]:g} s, then {time[frame + 1]:g} s)")
    late = np.abs(time) > LATEST
    if late.any():
        frame = int(np.argmax(late))
        raise ValueError(
            f"{source}: time is {time[frame]:g} s at {where(frame)}; it must lie in [{-LATEST:g}, {LATEST:g}] s"
        )


def angles(source: str, what: str, value: Array, columns: Sequence[str], where: Where = frame_number) -> None:
    """Check that angles are such as a sensor of a joint tells.

    Args:
        source: of the recording, for messages.
        what: `value` is, for messages.
        value: (T, J) rad.
        columns: (J,) names of the joints.
        where: says where a frame is.

    Raises:
        ValueError: at the first that is none.
    """
    said = f"beyond {LARGEST_ANGLE:.4g} rad; {UNIT}"
    _refuse(source, what, value, np.abs(value) > LARGEST_ANGLE, columns, said, where)


def torques(source: str, value: Array, columns: Sequence[str]) -> None:
    """Check that torques are fractions of their limits.

    Args:
        source: of the recording, for messages.
        value: (T, J).
        columns: (J,) names of the joints.

    Raises:
        ValueError: at the first that is none.
    """
    _refuse(source, "torques", value, np.abs(value) > 1.0, columns, "beyond [-1, 1]; they are fractions of the limits")


def leaps(source: str, value: Array, columns: Sequence[str], where: Where = frame_number) -> None:
    """Check that joint angles do not leap by a turn from one frame to the next.

    Args:
        source: of the recording, for messages.
        value: (T, J) rad.
        columns: (J,) names of the joints.
        where: says where a frame is.

    Raises:
        ValueError: at the first that does.
    """
    wrong = np.abs(np.diff(value, axis=0)) > LEAP
    if wrong.any():
        frame, joint = _first(wrong)
        before, after = value[frame : frame + 2, joint]
        raise ValueError(
            f"{source}: joint_angles of {columns[joint]} leap from {before:g} to {after:g} rad at "
            f"{where(frame + 1)}; no joint does, and a whole turn too much is taken out by "
            f"np.unwrap(joint_angles, axis=0) ({UNIT})"
        )


def reach(source: str, value: Array, hand: Hand) -> None:
    """Check that a hand can have joint angles: a recording may go beyond its limits, but not by `BEYOND`.

    Args:
        source: of the recording, for messages.
        value: (T, J) rad.
        hand: the hand.

    Raises:
        ValueError: at the first that it cannot have.
    """
    low, high = hand.joint_limits.T
    wrong = (value < low - BEYOND) | (value > high + BEYOND)
    if wrong.any():
        frame, joint = _first(wrong)
        raise ValueError(
            f"{source}: joint_angles of {hand.joint_names[joint]} is {value[frame, joint]:g} rad at frame {frame}; of "
            f"hand {hand.name!r} it has [{low[joint]:.3g}, {high[joint]:.3g}] rad, beyond which recordings may go by "
            f"{BEYOND:.3g}; {UNIT}"
        )


def places(source: str, what: str, value: Array) -> None:
    """Check that places are in a room.

    Args:
        source: of the recording, for messages.
        what: `value` is, for messages.
        value: (T, 3) m.

    Raises:
        ValueError: at the first that is in none.
    """
    said = f"beyond {FARTHEST:g} m; {METRES}"
    _refuse(source, what, value, np.abs(value) > FARTHEST, "xyz", said)


def turns(source: str, what: str, value: Array) -> None:
    """Check that quaternions are rotations.

    Args:
        source: of the recording, for messages.
        what: `value` is, for messages.
        value: (T, 4) wxyz.

    Raises:
        ValueError: at the first that is none.
    """
    largest = np.maximum(np.abs(value).max(axis=1), 1.0)  # whose square may be infinite
    with np.errstate(over="ignore"):
        length = largest * np.linalg.norm(value / largest[:, None], axis=1)
    wrong = np.abs(length - 1.0) > ROUNDED
    if wrong.any():
        frame = int(np.argmax(wrong))
        raise ValueError(
            f"{source}: {what} at frame {frame} has length {length[frame]:g}, but that of a rotation (wxyz) is 1, "
            f"got {value[frame].tolist()}"
        )


def together(source: str, root: Array, thing: Array) -> None:
    """Check that a hand and an object are near each other.

    Args:
        source: of the recording, for messages.
        root: (T, 3) m, places of the hand's root.
        thing: (T, 3) m, places of the object.

    Raises:
        ValueError: where they are too far apart.
    """
    apart = np.linalg.norm(thing - root, axis=1)
    if (apart > APART).any():
        frame = int(np.argmax(apart > APART))
        raise ValueError(
            f"{source}: object_position {thing[frame].tolist()} m and root_position {root[frame].tolist()} m lie "
            f"{apart[frame]:g} m apart at frame {frame}; a hand reaches at most {APART:g} m; {METRES}"
        )


def _refuse(
    source: str,
    what: str,
    value: Array,
    wrong: NDArray[np.bool_],
    columns: Sequence[str],
    said: str,
    where: Where = frame_number,
) -> None:
    """Raise `ValueError` that names the first entry of `value` that is `wrong`, and where it is."""
    if not wrong.any():
        return
    frame, *column = _first(wrong)
    of = f" of {columns[column[0]]}" if column else ""
    raise ValueError(f"{source}: {what}{of} is {value[(frame, *column)]:g} at {where(frame)}, {said}")


def _first(wrong: NDArray[np.bool_]) -> tuple[int, ...]:
    """The index of the first true entry."""
    return tuple(map(int, np.unravel_index(int(np.argmax(wrong)), wrong.shape)))
