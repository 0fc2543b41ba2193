"""What a recording of a hand is.

Shapes: T frames, J joints of the recording, P patches. Angles in radians, lengths in metres, quaternions wxyz.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env import readable, validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.moved import renamed
from haptic_env.recordings import checks

LARGEST_GAP = 0.1  # seconds: what lies between frames further apart is not known

__getattr__ = renamed(__name__, {"Felt": "ObserverInputs"})


class Track(NamedTuple):
    """The path of a rigid body, in the world.

    Attributes:
        position: (T, 3) m.
        quaternion: (T, 4) wxyz.
    """

    position: Array
    quaternion: Array

    def __repr__(self) -> str:
        return readable.line(self)


class ObserverInputs(NamedTuple):
    """What an observer was given at each frame.

    Attributes:
        torques: (T, J), fractions commanded on the way to the frame.
        joint_angles: (T, J) rad, noisy.
        contacts: (T, P).
    """

    torques: Array
    joint_angles: Array
    contacts: NDArray[np.bool_]

    def __repr__(self) -> str:
        return readable.line(self)


@dataclass(frozen=True, eq=False)
class Recording:
    """Joint angles through time, and what else is known.

    Attributes:
        source: where it comes from, for messages.
        time: (T,) s, rising.
        joint_names: (J,).
        joint_angles: (T, J) rad.
        root: the path of the hand's body `root_body`, or of the frame in which the hand's model is drawn where that is
            empty.
        root_body: name of a body of the hand's model.
        object: the path of the object.
        mesh: name of the object's file.
        felt: of an exploration, what an observer was given.
        settings: what the exploration was, as a script that saved it says.

    Raises:
        ValueError: for what is not finite, repeated or of another length, and for what no hand does (see `checks`); it
            names the frame.
    """

    source: str
    time: Array
    joint_names: tuple[str, ...]
    joint_angles: Array
    root: Track | None = None
    root_body: str = ""
    object: Track | None = None
    mesh: str = ""
    felt: ObserverInputs | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    __repr__ = readable.line

    def __post_init__(self) -> None:
        source = validate.plain(self.source)
        for what in ("root_body", "mesh"):
            validate.instance(f"{source}: {what}", getattr(self, what), str, "a text")
        frames = len(np.atleast_1d(checks.plain(source, "time", self.time)))
        if frames < 2:
            raise ValueError(f"{source}: a recording needs two frames, got {frames}")

        def numbers(what: str, value: Any, *shape: int, columns: Sequence[str] = ()) -> Array:
            return checks.numbers(source, what, value, (frames, *shape), columns)

        names = checks.names(source, self.joint_names)
        said = tuple(map(validate.plain, names))
        time = numbers("time", self.time)
        checks.times(source, time, np.inf)
        angles = numbers("joint_angles", self.joint_angles, len(names), columns=said)
        checks.angles(source, "joint_angles", angles, said)
        checks.leaps(source, angles, said)
        whole: dict[str, Any] = {"source": source, "joint_names": names, "time": time, "joint_angles": angles}
        for what in ("root", "object"):
            track: Track | None = getattr(self, what)
            if track is not None:
                place = numbers(f"{what}_position", track.position, 3, columns="xyz")
                turn = numbers(f"{what}_quaternion", track.quaternion, 4, columns="wxyz")
                checks.places(source, f"{what}_position", place)
                checks.turns(source, f"{what}_quaternion", turn)
                whole[what] = Track(place, turn)
        if "root" in whole and "object" in whole:
            checks.together(source, whole["root"].position, whole["object"].position)
        if self.felt is not None:
            torques = numbers("torques", self.felt.torques, len(names), columns=said)
            checks.torques(source, torques, said)
            felt = numbers("felt_angles", self.felt.joint_angles, len(names), columns=said)
            checks.angles(source, "felt_angles", felt, said)
            contacts = checks.plain(source, "contacts", self.felt.contacts)
            if contacts.ndim != 2 or len(contacts) != frames:
                raise ValueError(f"{source}: contacts must have shape ({frames}, P), got {contacts.shape}")
            whole["felt"] = ObserverInputs(
                torques, felt, validate.binary(f"{source}: contacts", contacts, contacts.shape)
            )
        for name, value in whole.items():
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.time)

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return float(self.time[-1] - self.time[0])

    def columns_of(self, hand: Hand) -> NDArray[np.int64]:
        """Find the joints of a hand.

        Args:
            hand: the hand.

        Returns:
            (J,) for each joint of `hand` its column here.

        Raises:
            ValueError: for joints that are missing, or that the hand does not have.
        """
        validate.instance("hand", hand, Hand, "a Hand, as haptic_env.hands.make gives")
        missing = [name for name in hand.joint_names if name not in self.joint_names]
        unknown = [name for name in self.joint_names if name not in hand.joint_names]
        if missing or unknown:
            parts = {"misses": missing, "has unknown": unknown}
            told = [f"{what} {validate.listed(some)}" for what, some in parts.items() if some]
            raise ValueError(
                f"{self.source}: the recording {' and '.join(told)}; the joints of hand {hand.name!r} are "
                f"{', '.join(hand.joint_names)}"
            )
        return np.array([self.joint_names.index(name) for name in hand.joint_names])

    def angles_of(self, hand: Hand) -> Array:
        """Give the angles of a hand's joints, in its order.

        Args:
            hand: the hand.

        Returns:
            (T, J) rad.

        Raises:
            ValueError: for other joints, or angles that it cannot have.
        """
        angles = self.joint_angles[:, self.columns_of(hand)]
        checks.reach(self.source, angles, hand)
        return angles

    def felt_of(self, hand: Hand) -> ObserverInputs:
        """Give what a hand felt, its joints in its order.

        Args:
            hand: the hand.

        Returns:
            What an observer was given.

        Raises:
            ValueError: where it does not tell what was felt, for other joints, or another number of patches.
        """
        if self.felt is None:
            raise ValueError(f"{self.source}: the recording does not tell what was felt")
        felt, columns = self.felt, self.columns_of(hand)
        if felt.contacts.shape[1] != len(hand.patches):
            raise ValueError(
                f"{self.source}: contacts of {felt.contacts.shape[1]} patches; hand {hand.name!r} has "
                f"{len(hand.patches)}"
            )
        return ObserverInputs(felt.torques[:, columns], felt.joint_angles[:, columns], felt.contacts)
