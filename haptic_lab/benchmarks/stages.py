"""How long each stage of a turn of the observer takes.

Shapes: T steps.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from haptic_env.arrays import Array
from haptic_lab.benchmarks.recording import BenchRecording
from haptic_lab.benchmarks.timings import clock
from observer import HapticSLAM, ShapePosterior
from observer.fastslam import PARTS


class Stopwatch:
    """Seconds that went by until each named part was done, summed until `read`."""

    def __init__(self, names: Iterable[str]) -> None:
        """Begin at nothing.

        Args:
            names: of the parts.
        """
        self.spent = dict.fromkeys(names, 0.0)
        self.last = clock()

    def start(self) -> None:
        """What comes next begins now."""
        self.last = clock()

    def done(self, part: str) -> None:
        """Count what has gone by since the last part was done.

        Args:
            part: which it belongs to.
        """
        now = clock()
        self.spent[part] += now - self.last
        self.last = now

    def read(self) -> dict[str, float]:
        """Read the clock, and set it back.

        Returns:
            Seconds of each part since the last time.
        """
        spent, self.spent = self.spent, dict.fromkeys(self.spent, 0.0)
        return spent


def stages(slam: HapticSLAM, shape: ShapePosterior, recording: BenchRecording) -> dict[str, Array]:
    """Time each stage of a turn of the observer and its classifier, on one thread.

    The forward model predicts once more before each step, from the same state, to be timed by itself.

    Args:
        slam: the observer.
        shape: its classifier.
        recording: what both are told.

    Returns:
        (T,) s of each stage, by its name.
    """
    slam.threads = 1
    watch, rows, joints = Stopwatch((*PARTS, "model", "rest", "classify")), [], recording.hand.joints
    belief = slam.reset(seed=0)
    shape.reset(seed=0)
    slam.on_part = watch.done
    try:
        for torque, felt, contacts in zip(recording.torques, recording.felt, recording.contacts, strict=True):
            state, command = slam.pose.mean[: 2 * joints].copy(), torque.astype(np.float64)
            watch.start()
            slam.pose.model.predict(state, command)  # type: ignore[attr-defined]
            watch.done("model")
            belief = slam.step(torque, felt, contacts)
            watch.done("rest")
            shape.update(belief)
            watch.done("classify")
            rows.append(watch.read())
    finally:
        slam.on_part = None
    del belief
    took = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return {
        "forward model": took["model"],
        "pose filter and lag, without it": np.maximum(took["pose"] - took["model"], 0.0),
        "match and touch, every particle": took["match"],
        "geometry, sweeps, random numbers": took["gather"] + took["map"],
        "occupancy of the belief that is held": took["settle"],
        "weigh and resample": took["weigh"] + took["resample"],
        "proposal, belief and checks": took["predict"] + took["belief"] + took["rest"],
        "classify (ShapePosterior.update)": took["classify"],
    }
