"""How old a belief is when it is handed on, and what an hour takes: minutes at 100 Hz, 200 particles, by the Lab
Streaming Layer, and an hour as fast as it goes.

python -m pytest -m statistical -s tests/haptic_lab/live/test_age_long.py
"""

from __future__ import annotations

import os
import uuid
from collections import defaultdict, deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import psutil
import pytest

from haptic_lab.commands import live
from haptic_lab.live import lsl
from haptic_lab.live.merging import LiveStep
from haptic_lab.live.session import Chunk, LiveSession, Sink, Told
from observer import warm_up
from tests.haptic_lab.live.streams import Played, moving
from tests.haptic_lab.live.test_live import session
from tests.haptic_lab.live.test_lsl import sending

pytest.importorskip("mne_lsl")
RATE = 100.0


def memory() -> float:
    """MiB that the process has."""
    return float(psutil.Process().memory_info().rss) / 2**20


class Ages:
    """A sink that takes the age of each belief: from the time of its step, by the clock that its samples came with."""

    def __init__(self) -> None:
        self.clock, self.ages, self.times = lsl.library().local_clock, [], []
        self.early = 0.0  # MiB

    def tell(self, told: Told) -> None:
        self.ages.append(self.clock() - told.time)
        self.times.append(told.time)
        if not self.early and self.times[-1] - self.times[0] > 20.0:
            self.early = memory()

    def close(self) -> None:
        pass


class Budget:
    """Where the age of a belief comes from: ms after the time of its step until a thing was done, or that it took."""

    def __init__(self, session: LiveSession, clock: Callable[[], float]) -> None:
        lately = lambda: deque[float](maxlen=3000)  # noqa: E731 - so that it takes no memory of its own
        self.clock, self.since, self.took = clock, defaultdict(lately), defaultdict(lately)
        self.read: dict[str, float] = {}
        self.take, self.observe = session.take, session.observe
        session.take, session.observe = self.taken, self.observed  # type: ignore[method-assign]
        for name, each in (("the pose", session.slam.pose), ("the observer", session.slam), ("names", session.namer)):
            self.time(name, each, "update" if name == "names" else "step")
        self.time("of the next step, beforehand", session.slam, "anticipate")

    def time(self, name: str, of: Any, method: str) -> None:
        call = getattr(of, method)

        def timed(*arguments: Any) -> Any:
            begun = self.clock()
            result = call(*arguments)
            self.took[name].append(self.clock() - begun)
            return result

        setattr(of, method, timed)

    def taken(self, chunk: Chunk, arrival: float) -> None:
        self.read["joints read" if chunk.stream.endswith("joints") else "touch read"] = self.clock()
        self.take(chunk, arrival)

    def observed(self, step: LiveStep, sinks: Sequence[Sink]) -> None:
        for name, when in {**self.read, "merged": self.clock()}.items():
            self.since[name].append(when - step.time)
        self.observe(step, sinks)

    def __str__(self) -> str:
        of = lambda told: ", ".join(f"{name} {1e3 * np.median(each):.2f}" for name, each in told.items())  # noqa: E731
        return f"ms after its samples were taken: {of(self.since)}; ms that it takes: {of(self.took)}"


@pytest.mark.statistical
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(("steps", "minutes"), [(50, 1), (100, 1), (50, 10), (100, 10)])
@pytest.mark.parametrize("hand", ["myo", "two_finger"])
def test_beliefs_are_of_now_and_nothing_is_lost(hand: str, steps: int, minutes: int) -> None:
    """How old they are, and how busy this machine is, is printed: an observer that is too slow for it falls behind."""
    seconds = 60.0 * minutes
    name, made = f"test{uuid.uuid4().hex[:8]}", []
    with sending(name, hand, RATE, seconds + 60.0):  # for as long as it compiles, too
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(live, "_run", lambda *all_: made.append(all_) or 0)
            streams = [f"{name}_joints", f"{name}_touch"]
            given = ["--lsl-in", *streams, "--hand", hand, "--control-hz", str(steps), "--lsl-out", name]
            source = lsl.LslSource(streams)  # the sender waits for it, until all is compiled
            patch.setattr(live, "LslSource", lambda _: source)
            assert live.main(given) == 0
        _, _, session, sinks = made[0]
        warm_up(session.slam.hand, observer=session.slam)
        source.begin()
        ages, before = Ages(), os.times()
        budget = Budget(session, ages.clock)
        session.run(source, [*sinks, ages], seconds)
        after, late_memory = os.times(), memory()
        source.close()
    late = 1000.0 * np.array(ages.ages[10 * steps :])  # the first seconds catch up with what came before
    median, most = np.quantile(late, (0.5, 0.99))
    busy = (after.user + after.system - before.user - before.system) / seconds
    print(f"\n{steps} steps a second: age of a belief: median {median:.1f} ms, p99 {most:.1f} ms of {len(late)}")
    print(budget)
    print(f"a step takes {1e3 * session.pace.seconds:.1f} ms by the clock; at most {session.pace.most:.2f} s behind")
    print(f"{session.merger.counts}; {ages.early:.0f} MiB after 20 s, {late_memory:.0f} MiB at the end")
    print(f"{busy:.0%} of a core; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    assert session.merger.counts.late == 0
    assert session.merger.counts.joints_missing == session.merger.counts.touch_missing == 0
    assert np.allclose(np.diff(ages.times), 1.0 / steps)
    assert late_memory - ages.early < 20.0


@pytest.mark.statistical
@pytest.mark.timeout(3600)
def test_an_hour_takes_no_more_memory_than_ten_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two fingers that move and touch all the time, 50 samples a second, by a clock that goes as fast as they come."""
    source, made = session()
    source.close()
    samples, taken, clock = 180_000, [], [0.0]
    monkeypatch.setattr("haptic_lab.live.session.time.monotonic", lambda: clock[0])
    time_, angles, contacts = moving(made.slam.hand, samples, touches=4 * 3600)

    def chunks():
        for first in range(0, samples, 100):
            if first % 30_000 == 0:
                taken.append(memory())
                print(f"{first} steps: {taken[-1]:.0f} MiB", flush=True)
            clock[0] += 2.0
            yield []  # it is later, and nothing has come yet: all that comes is then told at once
            rows = slice(first, first + 100)
            yield [Chunk(name, time_[rows], each[rows]) for name, each in (("joints", angles), ("contacts", contacts))]

    source = Played(chunks())
    source.session = made
    made.run(source, [])
    print(f"{made.merger.counts}; {memory():.0f} MiB at the end")
    assert made.merger.counts.steps == samples
    assert made.merger.counts.late == made.merger.counts.joints_missing == made.merger.counts.touch_missing == 0
    assert memory() - taken[1] < 20.0
