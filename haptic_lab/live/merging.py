"""Samples as they come, on the steps of an observer: as a whole recording is merged, but for what nobody can know yet.

A step is told as soon as no sample that comes in time can change it. What comes later than that changes nothing that
was told: a touch then counts for the next step, so that none is lost. Where a stream falls silent, steps wait for it
for `PATIENCE`, and are then told as not measured.

Shapes: T samples, J joints, P patches, M of them measured. Seconds. NaN: not measured.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.recordings.merging import BRIDGED, CLOSE, HELD, LATE, SAME, angles_of_one, contacts_of_one
from haptic_lab.live.buffer import StreamBuffer
from haptic_lab.live.counts import Counts
from haptic_lab.live.torques import HeldTorques

PATIENCE = 0.25  # s
AHEAD = 60.0  # s: so much is kept while there is no first pose of all joints
SILENT = 1.0  # s: of a stream that is silent for so long nothing is waited for
EARLY = 0.25  # of the interval: samples of touch come no earlier than that before they are due


class LiveStep(NamedTuple):
    """What an observer is told at a step.

    Attributes:
        time: s, on the line of all streams.
        joint_angles: (J,) rad.
        contacts: (P,) 0 or 1.
        torques: (J,) fractions that were commanded since the step before; None: they are not known.
    """

    time: float
    joint_angles: Array
    contacts: Array
    torques: Array | None = None


class LiveMerger:
    """Two streams, or three, on the steps of an observer.

    Attributes:
        counts: of samples and steps.
        torques: that are commanded; None: nobody tells.
    """

    def __init__(
        self,
        joints: int,
        patches: int,
        measured: NDArray[np.int64],
        rate: float,
        interval: float,
        torques: HeldTorques | None = None,
    ) -> None:
        """Begin before the first sample.

        Args:
            joints: J.
            patches: P.
            measured: (M,) the patches that are.
            rate: Hz, of the steps.
            interval: s, from one sample of touch to the next, usually.
            torques: that are commanded; None: nobody tells.
        """
        self.torques = torques
        self._commanded = StreamBuffer(joints) if torques is None else torques.samples
        self.counts, self._patches, self._measured = Counts(), patches, measured
        self._rate, self._interval = rate, interval
        self._keep = 2.0 * max(BRIDGED / rate, HELD * interval) + LATE
        self._reach = 1.01 * max(0.5 / rate, HELD * interval)  # s: no touch that is farther from a step counts for it
        self._joints, self._touch = StreamBuffer(joints), StreamBuffer(len(measured))
        self._start: float | None = None
        self._step, self._begun, self._next = 0.0, 0.0, 0
        self._carried = np.zeros(len(measured), dtype=bool)  # touched, but told too late for their own step

    def add_joints(self, stamps: Array, angles: Array, arrival: float) -> None:
        """Take in angles.

        Args:
            stamps: (T,) s, by the stream.
            angles: (T, J) rad.
            arrival: s, by this machine.
        """
        if not len(stamps):
            return
        time = self._heard(self._joints, stamps, arrival, self._touch)
        self.counts.joints += len(time)
        if self._start is not None:
            self.counts.late += int((time < self._told).sum())
        self.counts.repeated += self._joints.add(time, angles)
        if self._start is None:
            self._joints.forget(self._joints.newest - AHEAD)
            whole = np.isfinite(self._joints.values).all(axis=1)
            if whole.any():
                first = int(np.argmax(whole))
                self._start, self._begun = float(self._joints.time[first]), arrival
                self._step = (self._start + 1 / self._rate) - self._start  # as a recording's steps lie
                self._joints.forget(self._start)

    def add_touch(self, stamps: Array, contacts: Array, arrival: float) -> None:
        """Take in contacts.

        Args:
            stamps: (T,) s, by the stream.
            contacts: (T, M).
            arrival: s, by this machine.
        """
        if not len(stamps):
            return
        time = self._heard(self._touch, stamps, arrival, self._joints)
        self.counts.touch += len(time)
        if self._start is not None and self._next:
            late = np.rint((time - self._start) / self._step) < self._next
            self.counts.late += int(late.sum())
            self._carried |= (contacts[late] == 1.0).any(axis=0)
        self.counts.repeated += self._touch.add(time, contacts)
        if self._start is None:
            self._touch.forget(self._touch.newest - AHEAD)

    def add_torques(self, stamps: Array, torques: Array, arrival: float) -> None:
        """Take in torques.

        Args:
            stamps: (T,) s, by the stream.
            torques: (T, J) fractions.
            arrival: s, by this machine.
        """
        if not len(stamps) or self.torques is None:
            return
        time = self._heard(self._commanded, stamps, arrival, self._joints)
        self.counts.torques += len(time)
        self.counts.repeated += self._commanded.add(time, torques)
        if self._start is None:
            self._commanded.forget(self._commanded.newest - AHEAD)

    def waits_for(self) -> str:
        """Tell which stream the next step waits for: "joints", "touch" or "torques"."""
        if self._start is None or not self._joints_told(time := self._at(self._next)):
            return "joints"
        return "torques" if self.torques is not None and self._touch_told(time) else "touch"

    def silent(self, now: float) -> list[str]:
        """Tell which streams are silent.

        Args:
            now: s, by this machine.

        Returns:
            Their kinds.
        """
        kinds = {"joints": self._joints, "touch": self._touch}
        if self.torques is not None:
            kinds["torques"] = self._commanded
        return [kind for kind, each in kinds.items() if each.heard is not None and now - each.heard > SILENT]

    def ready(self, now: float) -> Iterator[LiveStep]:
        """Tell the steps of which all is known.

        Args:
            now: s, by this machine.

        Yields:
            One after the other.
        """
        while self._start is not None:
            time = self._at(self._next)
            if not (self._joints_told(time) or time <= self._end(self._joints, now)):
                return
            if not (self._touch_told(time) or time <= self._end(self._touch, now)):
                return
            if not (self._torques_told(time) or time <= self._end(self._commanded, now)):
                return
            yield self._tell(time)

    def rest(self, now: float) -> Iterator[LiveStep]:
        """Tell the steps up to the last sample of a joint, when no more will come.

        Steps whose touch was still to come, from a stream that is not silent, are left out.

        Args:
            now: s, by this machine.

        Yields:
            One after the other.
        """
        waits = self._touch.heard is not None and "touch" not in self.silent(now)
        while self._start is not None:
            time = self._at(self._next)
            if time > self._joints.newest + SAME * self._step or (waits and not self._touch_told(time)):
                return
            yield self._tell(time)

    @property
    def newest(self) -> float:
        """The time of the newest sample of joints, s; minus infinity where there is none."""
        return self._joints.newest

    def come(self) -> dict[str, tuple[int, float]]:
        """Tell how many samples of joints and of touch have come, and the time of the newest, s."""
        return {"joints": (self.counts.joints, self.newest), "touch": (self.counts.touch, self._touch.newest)}

    @property
    def _told(self) -> float:
        """The step that was told last."""
        return self._at(self._next - 1)

    def _at(self, step: int) -> float:
        assert self._start is not None
        return self._start + step / self._rate

    def _end(self, stream: StreamBuffer, now: float) -> float:
        """Up to when steps wait for a stream no longer."""
        if stream is not self._joints:
            since = self._begun if stream.heard is None else stream.heard
            if now - since > SILENT:
                return np.inf
        due = stream.clock.expected(now)
        return -np.inf if due is None else due - PATIENCE

    def _heard(self, stream: StreamBuffer, stamps: Array, arrival: float, other: StreamBuffer) -> Array:
        if stream.heard is None and (due := other.clock.expected(arrival)) is not None:
            stream.clock.begin(float(stamps[-1]), due)
        stream.heard = arrival
        time = stream.clock.mapped(stamps, arrival)
        self.counts.clock_steps = sum(each.clock.steps for each in (self._joints, self._touch, self._commanded))
        return time

    def _joints_told(self, time: float) -> bool:
        """Whether no sample of joints can change a step: each joint has one at it or after it."""
        # Clocks are corrected by some 0.1 ms: a step would else wait for the sample after its own.
        newest, close = self._joints.newest, time - CLOSE * self._step
        if newest > time + BRIDGED * self._step:
            return True
        if newest >= close and np.isfinite(self._joints.values[-1]).all():
            return True
        after = int(np.searchsorted(self._joints.time, close))
        return bool(np.isfinite(self._joints.values[after:]).any(axis=0).all())

    def _touch_told(self, time: float) -> bool:
        """Whether no sample of touch that is in time can be of a step, or be nearer to it than what there is."""
        ahead, newest = (1.0 - EARLY) * self._interval, self._touch.newest
        return newest + ahead > time + 0.5 * self._step and time - newest <= 0.5 * ahead

    def _torques_told(self, time: float) -> bool:
        """Whether what was commanded before a step is known, or nobody tells; nothing is before the first."""
        return self.torques is None or not self._next or self.torques.told(time)

    def _tell(self, time: float) -> LiveStep:
        about = self._keep
        contacts = np.full(self._patches, np.nan)
        near = self._joints.about(time - 2.0 * BRIDGED * self._step, time + 2.0 * BRIDGED * self._step)
        angles = angles_of_one(near, time, self._step)
        near = self._touch.about(time - self._reach, time + self._reach)
        if len(near):
            assert self._start is not None
            told = contacts_of_one(near, time, (self._start, self._step), self._interval)
            contacts[self._measured] = np.where(self._carried, 1.0, told)
        self._carried[:] = False
        torques = None
        if self.torques is not None:
            torques = self.torques.between(time - self._step, time) if self._next else np.zeros(len(angles))
            self._commanded.forget(time - about)
        self._next += 1
        self.counts.steps += 1
        self.counts.joints_missing += bool(np.isnan(angles).any())
        self.counts.touch_missing += bool(np.isnan(contacts).all())
        self._joints.forget(time - about)
        self._touch.forget(time - about)
        return LiveStep(time, angles, contacts, torques)
