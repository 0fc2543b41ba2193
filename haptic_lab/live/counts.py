"""What became of the samples of a session."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Counts:
    """What became of samples.

    Attributes:
        joints: that came.
        touch: that came.
        torques: that came.
        late: that came when their step was told.
        repeated: with the time stamp of another.
        refused: numbers that no joint, or no contact, can have.
        clock_steps: how often a clock has stepped.
        steps: that were told.
        joints_missing: steps without the angle of some joint.
        touch_missing: steps without any touch.
    """

    joints: int = 0
    touch: int = 0
    torques: int = 0
    late: int = 0
    repeated: int = 0
    refused: int = 0
    clock_steps: int = 0
    steps: int = 0
    joints_missing: int = 0
    touch_missing: int = 0
