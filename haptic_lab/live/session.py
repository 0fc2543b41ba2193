"""An observer beside a moving hand: what comes is merged by time, told to it, and what it believes is handed on.

Shapes: T samples, C columns, J joints, C labels.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_lab.live.layout import JointLayout, TorqueLayout, TouchLayout
from haptic_lab.live.merging import LiveMerger, LiveStep
from haptic_lab.live.pace import Pace
from haptic_lab.live.rates import Rates
from haptic_lab.live.record import StepRecord
from haptic_lab.live.torques import HeldTorques
from observer import Belief, HapticSLAM, ShapePosterior

NEVER = 5.0  # s: what has not come by then is told, and again each time that it was waited for twice as long
READ = 0.1  # s: so often what has come is read, however many steps wait
LOST = {  # what it means that nothing comes
    "joints": "no joint is measured, and the belief grows vaguer",
    "touch": "no touch is measured, and the belief grows vaguer",
    "torques": "no torques are known, and zero is told",
}


class Chunk(NamedTuple):
    """Samples of a stream.

    Attributes:
        stream: its name.
        stamps: (T,) s.
        values: (T, C).
        arrival: s, by this machine, when they were read; None: now.
    """

    stream: str
    stamps: Array
    values: Array
    arrival: float | None = None


class Source(Protocol):
    """Where samples come from."""

    def begin(self) -> None:
        """Let go of what has come while all was made ready."""

    def poll(self, stream: str, seconds: float) -> Sequence[Chunk]:
        """Hand out what has come, of any stream.

        Args:
            stream: that is waited for.
            seconds: at most.
        """

    def close(self) -> None:
        """End it."""


class Told(NamedTuple):
    """What is believed at a step, to be handed on.

    Attributes:
        time: s, of the step, by the line of all streams.
        belief: of it.
        labels: what the object may be.
        posterior: probability of each.
        entropy: bits, of these.
    """

    time: float
    belief: Belief
    labels: tuple[str, ...]
    posterior: Array
    entropy: float


class Sink(Protocol):
    """Where beliefs go."""

    def tell(self, told: Told) -> None:
        """Hand on.

        Args:
            told: what is believed.
        """

    def close(self) -> None:
        """End it."""


def entropy(posterior: Array) -> float:
    """Tell how unsure names are.

    Args:
        posterior: (C,) probabilities.

    Returns:
        Bits.
    """
    some = posterior[posterior > 0.0]
    return float(-(some * np.log2(some)).sum()) + 0.0


class LiveSession:
    """Runs until it is told to stop.

    Attributes:
        slam: the observer.
        namer: names the object.
        merger: of the streams.
        record: of the steps.
        pace: of the observer.
        told: what was believed last; None: there was no step.
        stop: set to end it.
    """

    def __init__(
        self,
        slam: HapticSLAM,
        namer: ShapePosterior,
        layouts: tuple[JointLayout, TouchLayout, TorqueLayout | None],
        intervals: tuple[float, float],
        seed: int,
        record: StepRecord,
        say: Callable[[str], object],
    ) -> None:
        """Put it together.

        Args:
            slam: the observer.
            namer: names the object.
            layouts: of joints, of touch and, where they are told, of torques.
            intervals: s, from one sample of touch, and of torques, to the next, usually.
            seed: of all that is left to chance.
            record: of the steps.
            say: told what is to be known, in a line.
        """
        self.slam, self.namer, self.record, self._say = slam, namer, record, say
        angles, touch, drive = layouts
        joints, patches = slam.hand.joints, len(slam.hand.patches)
        measured: NDArray[np.int64] = touch.measured
        torques = None if drive is None else HeldTorques(joints, intervals[1])
        self.merger = LiveMerger(joints, patches, measured, slam.control_hz, intervals[0], torques)
        self._streams = {"joints": angles.stream, "touch": touch.stream}
        self._readers = {
            "joints": (angles.angles, self.merger.add_joints),
            "touch": (touch.contacts, self.merger.add_touch),
        }
        if drive is not None:
            self._streams["torques"] = drive.stream
            self._readers["torques"] = drive.torques, self.merger.add_torques
        # As a trial gives it to its observers.
        self._seed = int(np.random.SeedSequence(seed).generate_state(2)[1])
        self.pace = Pace(slam.control_hz)
        self._rates = Rates(self._streams, {"joints": slam.control_hz, "touch": 1.0 / intervals[0]})
        self.told: Told | None = None
        self.stop = False
        self._never: dict[str, float] = {}
        self._silent: set[str] = set()
        self._seen = self.merger.counts.clock_steps

    def run(self, source: Source, sinks: Sequence[Sink], seconds: float | None = None) -> None:
        """Take in what comes until `stop` is set.

        Args:
            source: of the samples.
            sinks: to which beliefs are told.
            seconds: after which it ends; None: it does not.
        """
        begun = time.monotonic()
        while not self.stop and (seconds is None or time.monotonic() - begun < seconds):
            now = time.monotonic()  # what has come since may not have been read: on a busy machine that is much
            for chunk in source.poll(self._streams[self.merger.waits_for()], 0.02):
                self.take(chunk, time.monotonic())
            for step in self.merger.ready(now):
                started = time.monotonic()
                self.observe(step, sinks)
                ended = time.monotonic()
                self.pace.step(ended - started)
                if self.stop or ended - now > READ:
                    break
            self._warn(now, begun)
        for step in self.merger.rest(time.monotonic()):
            self.observe(step, sinks)

    def take(self, chunk: Chunk, arrival: float) -> None:
        """Take samples in.

        Args:
            chunk: of a stream.
            arrival: s, by this machine, where the chunk does not tell.
        """
        # Read one stream after the other: where that takes long, the second is as far ahead as it was read later.
        arrival = arrival if chunk.arrival is None else chunk.arrival
        for kind, (read, add) in self._readers.items():
            if chunk.stream == self._streams[kind]:
                told, odd = read(chunk.values)
                self.merger.counts.refused += odd
                add(chunk.stamps, told, arrival)

    def observe(self, step: LiveStep, sinks: Sequence[Sink]) -> None:
        """Tell the observer, and hand on what it believes.

        Args:
            step: what was felt.
            sinks: to which it is told.
        """
        first, self.told = self.told is None, None  # whose map nobody asked for: the step need not compute it
        try:
            if first:
                belief = self.slam.reset(self._seed, step.joint_angles)
                posterior = self.namer.reset(self._seed)
            else:
                belief = self.slam.step(step.torques, step.joint_angles, step.contacts)
                posterior = self.namer.update(belief)
            self.told = Told(step.time, belief, self.namer.labels, posterior, entropy(posterior))
            for sink in sinks:
                sink.tell(self.told)
        finally:  # also of a step that failed, so that it can be told again
            self.record.add(step)
        self.slam.anticipate()  # what can be done of the next step before its samples come

    def _warn(self, now: float, begun: float) -> None:
        """Tell of streams that do not come, or come no more, and of clocks that step."""
        counts = self.merger.counts
        silent = self.merger.silent(now)
        for kind, stream in self._streams.items():
            count = getattr(counts, kind)
            never = f"no samples of {kind} have come from {stream} for {now - begun:.0f} s; waiting on"
            if not count and now - begun > self._never.get(kind, NEVER):
                self._never[kind] = 2.0 * (now - begun)
                self._say(never)
            if (kind in silent) != (kind in self._silent):
                self._silent ^= {kind}
                self._say(f"{stream} is silent: {LOST[kind]}" if kind in silent else f"{stream} is back")
        for seldom in self._rates.told(self.merger.come(), silent):
            self._say(seldom)
        slow = self.pace.told(0.0 if self.told is None else self.merger.newest - self.told.time)
        if slow is not None:
            self._say(slow)
        if counts.clock_steps > self._seen:
            self._seen = counts.clock_steps
            self._say("the clock of a stream has stepped; its samples go on where they were")
