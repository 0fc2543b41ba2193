"""What a real hand felt, told step by step; nothing is simulated, and nobody knows the truth.

NaN: not measured.
"""

from __future__ import annotations

from typing import Any

from haptic_env import validate
from haptic_env.playback import FeltPlayback, Observation
from haptic_env.recordings.measured import MeasuredTouch
from haptic_env.shapes.base import Solid


class MeasuredPlayback(FeltPlayback):
    """A hand that moved and felt what is recorded: an action changes nothing."""

    def __init__(self, recording: MeasuredTouch, solid: Solid | None = None) -> None:
        """Begin before the first step.

        Args:
            recording: with measured touch.
            solid: what was touched, where it is told; None: nobody says.

        Raises:
            ValueError: for what is no such recording.
        """
        validate.instance("recording", recording, MeasuredTouch, "a MeasuredTouch, as read_measured gives")
        super().__init__(recording.hand, recording.control_hz, len(recording))
        self.recording, self.solid = recording, solid

    def _observe(self) -> Observation:
        told = self.recording
        return {"joint_angles": told.joint_angles[self._steps].copy(), "contacts": told.contacts[self._steps].copy()}

    def _info(self) -> dict[str, Any]:
        return {"solid": self.solid}
