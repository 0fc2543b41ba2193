"""What was told to the observer, kept as a recording that `haptic-slam replay` plays to the same beliefs, bit for bit.

Shapes: K steps, J joints, P patches. NaN: not measured. An hour of MyoHand's 23 joints and 157 patches at 100 Hz takes
123 MB, and 66 MB more with torques.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.files import atomic, check_writable
from haptic_env.hand import Hand
from haptic_env.recordings.streams import arrays_of
from haptic_lab.live.merging import LiveStep

ROOM = 4096  # steps that are made room for at once
UNMEASURED = -1  # in place of a contact


class StepRecord:
    """The steps of a session."""

    def __init__(self, path: Path | None, hand: Hand, control_hz: float, torques: bool = False) -> None:
        """Begin with none.

        Args:
            path: of the `.npz` that is written at the end; None: nothing is kept.
            hand: with J joints and P patches.
            control_hz: Hz, of the steps.
            torques: whether they are told.

        Raises:
            ValueError: where it cannot be written, or is no `.npz`.
        """
        self.path, self._hand, self._rate = path, hand, control_hz
        if path is not None:
            if path.suffix.lower() != ".npz":
                raise ValueError(f"--record must be an .npz, got {str(path)!r}")
            check_writable("--record", path)
        self._angles: list[Array] = []  # of ROOM steps each
        self._contacts: list[NDArray[np.int8]] = []
        self._torques: list[Array] | None = [] if torques else None
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, step: LiveStep) -> None:
        """Keep a step.

        Args:
            step: as it was told.
        """
        if self.path is None:
            return
        block, row = divmod(self._count, ROOM)
        if block == len(self._angles):
            self._angles.append(np.empty((ROOM, self._hand.joints)))
            self._contacts.append(np.empty((ROOM, len(self._hand.patches)), dtype=np.int8))
            if self._torques is not None:
                self._torques.append(np.empty((ROOM, self._hand.joints)))
        self._angles[block][row] = step.joint_angles
        self._contacts[block][row] = np.where(np.isnan(step.contacts), UNMEASURED, step.contacts)
        if self._torques is not None and step.torques is not None:
            self._torques[block][row] = step.torques
        self._count += 1

    def arrays(self) -> dict[str, Array]:
        """Give what there is.

        Returns:
            As `haptic_env.recordings.streams.arrays_of`.
        """
        angles = np.concatenate(self._angles)[: self._count]
        told = np.concatenate(self._contacts)[: self._count]
        contacts: Array = np.where(told == UNMEASURED, np.float32(np.nan), told.astype(np.float32))
        torques = None if self._torques is None else np.concatenate(self._torques)[: self._count]
        return arrays_of(self._hand, self._rate, angles, contacts, torques)

    def write(self) -> bool:
        """Write the file, whole or not at all.

        Returns:
            Whether there was anything to be kept.
        """
        if self.path is None or not self._count:
            return False
        arrays: dict[str, Any] = self.arrays()
        with atomic(self.path) as place:
            np.savez_compressed(place, **arrays)
        return True
