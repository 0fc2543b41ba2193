"""What was told to the observer, kept as a recording that `haptic-slam replay` plays to the same beliefs, bit for bit.

Shapes: K steps, J joints, P patches. NaN: not measured.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from haptic_env.arrays import Array
from haptic_env.files import atomic, check_writable
from haptic_env.hand import Hand
from haptic_env.recordings.streams import arrays_of
from haptic_lab.live.merging import LiveStep

ROOM = 4096  # steps that are made room for at once


class StepRecord:
    """The steps of a session."""

    def __init__(self, path: Path | None, hand: Hand, control_hz: float) -> None:
        """Begin with none.

        Args:
            path: of the `.npz` that is written at the end; None: nothing is kept.
            hand: with J joints and P patches.
            control_hz: Hz, of the steps.

        Raises:
            ValueError: where it cannot be written, or is no `.npz`.
        """
        self.path, self._hand, self._rate = path, hand, control_hz
        if path is not None:
            if path.suffix.lower() != ".npz":
                raise ValueError(f"--record must be an .npz, got {str(path)!r}")
            check_writable("--record", path)
        self._rows = np.empty((ROOM, hand.joints + len(hand.patches)))
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
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._rows[self._count] = np.concatenate([step.joint_angles, step.contacts])
        self._count += 1

    def arrays(self) -> dict[str, Array]:
        """Give what there is.

        Returns:
            As `haptic_env.recordings.streams.arrays_of`, and `control_hz`.
        """
        rows = self._rows[: self._count]
        angles, contacts = rows[:, : self._hand.joints], rows[:, self._hand.joints :]
        return {**arrays_of(self._hand, self._rate, angles, contacts), "control_hz": np.array(self._rate)}

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
