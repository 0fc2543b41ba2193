"""What a recording of a hand is.

Shapes: T frames, J joints of the recording, P patches. Angles in radians, lengths in metres, quaternions wxyz.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.hand import Hand

Array = NDArray[np.float64]
LARGEST_GAP = 0.1  # seconds: what lies between frames further apart is not known


class Track(NamedTuple):
    """The path of a rigid body: `position` (T, 3) m and `quaternion` (T, 4) wxyz in the world."""

    position: Array
    quaternion: Array


class Felt(NamedTuple):
    """What an observer was given at each frame: `torques` (T, J), fractions commanded on the way to the frame, the
    noisy `joint_angles` (T, J) rad and the `contacts` (T, P)."""

    torques: Array
    joint_angles: Array
    contacts: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Recording:
    """Joint angles through time, and what else is known.

    `source`: where it comes from, for messages. `time` (T,) s, rising; `joint_names` (J,); `joint_angles` (T, J) rad.
    `root`: the path of the hand's body `root_body`, or of the frame in which the hand's model is drawn where that is
    empty; `object`: that of the object; `mesh`: the name of its file. `felt`: of an exploration with an observer.
    `settings`: what the exploration was, as a script that saved it says.

    Raises `ValueError` that names the frame for what is not finite, repeated or of another length.
    """

    source: str
    time: Array
    joint_names: tuple[str, ...]
    joint_angles: Array
    root: Track | None = None
    root_body: str = ""
    object: Track | None = None
    mesh: str = ""
    felt: Felt | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        frames, joints = len(self.time), len(self.joint_names)
        if frames < 2:
            raise ValueError(f"{self.source}: a recording needs two frames, got {frames}")
        names = list(self.joint_names)
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"{self.source}: joint {', '.join(twice)} is named twice")
        check_finite(self.source, "time", self.time, (frames,))
        check_times(self.source, self.time, np.inf)
        check_finite(self.source, "joint_angles", self.joint_angles, (frames, joints), self.joint_names)
        for what, track in (("root", self.root), ("object", self.object)):
            if track is not None:
                check_finite(self.source, f"{what}_position", track.position, (frames, 3), "xyz")
                check_finite(self.source, f"{what}_quaternion", track.quaternion, (frames, 4), "wxyz")
                zero = np.linalg.norm(track.quaternion, axis=1) < 1e-6
                if zero.any():
                    raise ValueError(f"{self.source}: {what}_quaternion is zero at frame {int(np.argmax(zero))}")
        if self.felt is not None:
            check_finite(self.source, "torques", self.felt.torques, (frames, joints), self.joint_names)
            check_finite(self.source, "felt_angles", self.felt.joint_angles, (frames, joints), self.joint_names)
            if self.felt.contacts.ndim != 2 or len(self.felt.contacts) != frames:
                raise ValueError(
                    f"{self.source}: contacts must have shape ({frames}, P), got {self.felt.contacts.shape}"
                )

    def __len__(self) -> int:
        return len(self.time)

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return float(self.time[-1] - self.time[0])

    def columns_of(self, hand: Hand) -> NDArray[np.int64]:
        """(J,) for each joint of `hand` its column here; raises `ValueError` for joints that are missing, or that the
        hand does not have."""
        missing = [name for name in hand.joint_names if name not in self.joint_names]
        unknown = [name for name in self.joint_names if name not in hand.joint_names]
        if missing or unknown:
            told = [f"misses {', '.join(missing)}"] * bool(missing) + [f"has unknown {', '.join(unknown)}"] * bool(
                unknown
            )
            raise ValueError(
                f"{self.source}: the recording {' and '.join(told)}; the joints of hand {hand.name!r} are "
                f"{', '.join(hand.joint_names)}"
            )
        return np.array([self.joint_names.index(name) for name in hand.joint_names])


def check_finite(source: str, what: str, value: Array, shape: tuple[int, ...], columns: Sequence[str] = ()) -> None:
    """Raise `ValueError` where `value` has another `shape`, or that names the first frame that is not finite."""
    if value.shape != shape:
        raise ValueError(f"{source}: {what} must have shape {shape}, got {value.shape}")
    wrong = np.argwhere(~np.isfinite(value))
    if len(wrong):
        frame, *column = wrong[0]
        of = f" of {columns[column[0]]}" if column else ""
        raise ValueError(f"{source}: {what}{of} is {value[tuple(wrong[0])]} at frame {frame}")


def check_times(
    source: str, time: Array, largest_gap: float, where: Callable[[int], str] = lambda frame: f"frame {frame}"
) -> None:
    """Raise `ValueError` that tells `where` time is repeated, runs back, or leaps by more than `largest_gap` s."""
    steps = np.diff(time)
    for wrong, told in (
        (steps == 0, "repeats the time stamp before it"),
        (steps < 0, "lies before the one before it in time"),
        (steps > largest_gap, f"comes after a gap of more than {largest_gap:g} s"),
    ):
        if wrong.any():
            frame = int(np.argmax(wrong))
            raise ValueError(f"{source}: {where(frame + 1)} {told} ({time[frame]:g} s, then {time[frame + 1]:g} s)")
