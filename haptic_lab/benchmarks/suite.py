"""Everything that the benchmark measures, and the figures that follow from it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from joblib import cpu_count
from rich.console import Console

from haptic_env import shapes
from haptic_env.arrays import Array
from haptic_lab.benchmarks import end_to_end, side_by_side, timings
from haptic_lab.benchmarks.live import HZ, live_steps
from haptic_lab.benchmarks.naming import naming_steps
from haptic_lab.benchmarks.recording import BenchRecording, make_slam, record
from haptic_lab.benchmarks.settings import QUICK, BenchSettings, BenchSize
from haptic_lab.benchmarks.stages import stages
from haptic_lab.benchmarks.table import BenchRow, beyond, number, of_steps, spread
from observer import HapticSLAM, ShapePosterior
from observer.configuration import LAG_SECONDS

PROCESS = ("import", "make", "first step", "first step into the maps")
PASSES = 10  # of env.step a round, between the other measurements: its parts are of microseconds
WHOLE_HAND = "HapticSLAM/MyoHand-v0"
PEER_MICROSECONDS = 250.0  # a particle and observation: MRPT's rbpf-slam, at its best
STAGES = {  # and whether it deals with the present step or with the lagged one
    "forward model": True,
    "pose filter and lag, without it": True,
    "match and touch, every particle": False,
    "geometry, sweeps, random numbers": False,
    "occupancy of the belief that is held": False,
    "weigh and resample": False,
    "proposal, belief and checks": False,
    "classify (ShapePosterior.update)": False,
}


Values = dict[str, Any]  # by name: (T,) seconds, or one number


def rounds(measurements: list[Callable[[], Values]], count: int, console: Console) -> Values:
    """Take every measurement once a round, so that what else the machine does meets all of them.

    Args:
        measurements: each returns values by name.
        count: of the rounds.
        console: says how far it is.

    Returns:
        All rounds stacked, by name: (rounds, T) or (rounds,).
    """
    found: dict[str, list[Any]] = {}
    with console.status("") as status:
        for turn in range(count):
            for number, measure in enumerate(measurements, start=1):
                status.update(f"round {turn + 1} of {count}, measurement {number} of {len(measurements)} …")
                for name, value in measure().items():
                    found.setdefault(name, []).append(value)
    return {name: np.array(values) for name, values in found.items()}


def learner_figures(settings: BenchSettings, console: Console) -> list[BenchRow]:
    """Measure how many steps a learner gets, and nothing else.

    Args:
        settings: of the benchmark.
        console: says how far it is.

    Returns:
        The rows.
    """
    size, cores = QUICK if settings.quick else BenchSize(), cpu_count()
    found = rounds(side_by_side.measurements(settings, size, cores), settings.rounds, console)
    return side_by_side.rows(found, size.together, cores)


class Bench:
    """Everything that is measured, and the figures that follow from it."""

    def __init__(self, settings: BenchSettings) -> None:
        """Record the exploration, and make the observers that are measured on it.

        Args:
            settings: of the benchmark.
        """
        self.settings = settings
        self.size = size = QUICK if settings.quick else BenchSize()
        self.cores = cpu_count()
        self.threads: list[int | None] = [None, *sorted({1, min(2, self.cores)})]
        self.recording = record(settings.env, settings.shape, settings.sigma, settings.seed, size.steps)
        self.slams = {
            (particles, voxels): make_slam(self.recording, particles, voxels)
            for voxels in (size.coarse, size.fine)
            for particles in (size.few, size.many)
        }
        self.shape = ShapePosterior(self.recording.hand)
        self.whole: tuple[BenchRecording, HapticSLAM] | None = None
        try:
            recording = record(WHOLE_HAND, settings.shape, settings.sigma, settings.seed, size.steps)
            self.whole = recording, HapticSLAM(recording.hand, settings.sigma, size.few)
        except ImportError as error:
            self.missing = str(error)
        self.lag = self.slams[size.few, size.coarse].lag
        self.now, self.late = self.recording.touching, self.recording.lagged(self.lag)

    def warm_up(self) -> None:
        """Compile what is not in the cache."""
        timings.environment(self.recording)
        self._stages()
        if self.whole:
            self._observe(self.whole, None, False)
            self._live()

    def measurements(self) -> list[Callable[[], Values]]:
        """List what one round takes.

        Returns:
            Functions for `rounds`.
        """
        asked, size = self.settings, self.size
        trial = asked.env, asked.shape, asked.sigma, size.seconds, size.few, asked.seed
        others: list[Callable[[], Values]] = [
            lambda: {"kinematics": timings.kinematics(self.recording)},
            lambda: {"bandwidth": timings.copy_bandwidth(size.megabytes)},
            lambda: {"PoseFilter.step": timings.pose_filter(self.slams[size.few, size.coarse], self.recording)},
            self._stages,
            partial(end_to_end.whole_trial, *trial),
            lambda: {"decisions": end_to_end.decisions(*trial[:3], 0.5 * size.seconds, asked.seed, None)},
            lambda: {"naming": naming_steps(asked.env, asked.sigma, size.seconds, asked.seed, self._among())},
            *side_by_side.measurements(asked, size, self.cores),
            partial(end_to_end.fresh_process, asked.env, asked.shape, size.few, size.coarse, 30),
            *([self._live] if self.whole else []),
            *(partial(self._observe, what, threads, busy) for what, threads, busy in self._observed()),
        ]
        passes = [partial(timings.environment, self.recording, turn) for turn in range(PASSES)]
        return [each for some in itertools.zip_longest(passes, others) for each in some if each is not None]

    def _among(self) -> tuple[str, ...]:
        """What it may be that is named."""
        return shapes.read_set(self.settings.objects)[: self.size.candidates]

    def _stages(self) -> Values:
        return stages(self.slams[self.size.few, self.size.coarse], self.shape, self.recording)

    def _observed(self) -> Iterator[tuple[tuple[BenchRecording, HapticSLAM], int | None, bool]]:
        """Who is observed, on how many threads (None: nothing is said), and whether beside other busy processes."""
        for what in (*((self.recording, slam) for slam in self.slams.values()), *([self.whole] if self.whole else ())):
            for threads in self.threads:
                yield from ((what, threads, busy) for busy in (False, True))

    def _observe(self, what: tuple[BenchRecording, HapticSLAM], threads: int | None, busy: bool) -> Values:
        recording, slam = what
        with timings.neighbours(self.cores if busy else 0):
            return {_slam(recording, slam, threads, busy): timings.observe(slam, recording, threads)}

    def _live(self) -> Values:
        assert self.whole is not None
        return {"live": live_steps(self.whole[0], WHOLE_HAND, self.size.few)}

    def figures(self, console: Console) -> list[BenchRow]:
        """Measure all rounds.

        Args:
            console: says how far it is.

        Returns:
            The rows of the table, in its order.
        """
        size = self.size
        found = rounds(self.measurements(), self.settings.rounds, console)
        touched = {
            voxels: float(np.median(timings.bytes_touched(self.slams[size.few, voxels], self.recording)[self.lag :]))
            for voxels in (size.coarse, size.fine)
        }
        large = end_to_end.fresh_process(self.settings.env, self.settings.shape, size.many, size.fine, size.steps)
        return [
            *self._of_steps(found),
            *self._of_slam(found, touched),
            *self._of_whole_hand(found),
            *self._of_stages(found),
            *self._of_memory(found, touched, large),
            *self._of_the_whole(found),
            *side_by_side.rows(found, size.together, self.cores),
        ]

    def _of_steps(self, found: Values) -> list[BenchRow]:
        pose = found["forward model"] + found["pose filter and lag, without it"]
        return [
            beyond(found["env.step"], found["mj_step"], self.now),
            of_steps("env.step", found["env.step"], self.now, note="its mj_step calls included"),
            of_steps("PoseFilter.step, alone", found["PoseFilter.step"], self.now),
            of_steps("PoseFilter.step, between map updates", pose, self.now, note="which empty the processor's caches"),
        ]

    def _of_slam(self, found: Values, touched: dict[int, float]) -> list[BenchRow]:
        plain = 1e6 * timings.plain(self.slams[self.size.few, self.size.coarse], self.recording)
        note = f"{self.size.coarse}³; the tests' oracle"
        rows = [BenchRow("a particle and step with contact in plain NumPy", "µs", plain, note=note)]
        bandwidth = float(np.median(found["bandwidth"]))
        for (particles, voxels), slam in self.slams.items():
            share = touched[voxels] * particles / bandwidth

            def told(seconds: float, each: float = 1e6 / particles, share: float = share) -> str:
                each *= seconds
                return (
                    f"{number(each)} µs a particle: 1/{plain / each:.0f} of NumPy, "
                    f"1/{PEER_MICROSECONDS / each:.0f} of MRPT; {share / seconds:.1%} of the copy bandwidth"
                )

            rows += self._of_settings(found, self.recording, slam, told)
        return rows

    def _of_settings(
        self, found: Values, recording: BenchRecording, slam: HapticSLAM, told: Callable[[float], str]
    ) -> list[BenchRow]:
        """The same observer by all numbers of threads; how far that of a user who says nothing is from the best."""
        rows, late = [], recording.lagged(slam.lag)
        for busy in (False, True):
            names = {threads: _slam(recording, slam, threads, busy) for threads in self.threads}
            took = {t: float(np.median(np.median(found[name], axis=0)[slam.lag :])) for t, name in names.items()}
            best = min(took.values())
            for threads, name in names.items():
                note = told(took[threads]) if threads == 1 and not busy else ""
                if threads is None:
                    note = f"{took[None] / best:.2f} of the best number of threads"
                rows.append(of_steps(name, found[name], late, slam.lag, unit="ms", note=note))
        return rows

    def _of_whole_hand(self, found: Values) -> list[BenchRow]:
        if self.whole is None:
            return [BenchRow("HapticSLAM.step of MyoHand", "ms", math.nan, note=f"skipped: {self.missing}")]
        recording, slam = self.whole
        voxels = "×".join(map(str, slam.grid.shape))
        steps = np.median(found[_slam(recording, slam, 1, False)], axis=0)[slam.lag :]
        told = f"J = {recording.hand.joints}, P = {len(recording.hand.patches)}, {voxels}"
        note = f"{told}; 90 % of steps below {1e3 * np.percentile(steps, 90):.1f} ms"
        rows = self._of_settings(found, recording, slam, lambda _: note)
        lag = round(LAG_SECONDS * HZ)
        late, note = recording.lagged(lag), "smooth motion; merged, observed and named; 1 core"
        return [*rows, of_steps(f"a live step at {HZ:g} Hz, MyoHand", found["live"], late, lag, unit="ms", note=note)]

    def _of_stages(self, found: Values) -> list[BenchRow]:
        note = f"N = {self.size.few}, {self.size.coarse}³, 1 thread"
        rows = [
            of_steps(
                f"stage: {name}", found[name], self.now if present else self.late, 0 if present else self.lag, note=note
            )
            for name, present in STAGES.items()
        ]
        frames = 1e6 * found["kinematics"]
        note = "forward kinematics; done a few times a step, whatever N is"
        return [*rows, BenchRow("kinematics of one pose", "µs", *spread(frames), note)]

    def _of_memory(self, found: Values, touched: dict[int, float], large: dict[str, float]) -> list[BenchRow]:
        size, note = self.size, "lines of its map that changed, read and written"
        return [
            BenchRow("copy bandwidth", "GB/s", *spread(found["bandwidth"] / 1e9), "np.copyto, read and written"),
            *(BenchRow(f"bytes a step and particle, {n}³", "B", each, note=note) for n, each in touched.items()),
            BenchRow(
                f"memory, N = {size.many}, {size.fine}³",
                "MB",
                large["after"] / 1e6,
                note=f"peak of a process; {large['before'] / 1e6:.0f} before the trial",
            ),
        ]

    def _of_the_whole(self, found: Values) -> list[BenchRow]:
        trial, seconds = found["trial"], self.size.seconds
        decided = 1e3 * found["decisions"]
        most = np.percentile(np.median(decided, axis=0), 90)
        asked = 1e3 * np.median(found["map_now"], axis=1)
        name = "a decision of information_gain"
        told = f"size and place unknown; {decided.shape[1]} of an exploration, 90 % below {most:.0f} ms"
        note = f"N = {self.size.few}, names the object; {seconds / np.median(trial):.1f} times real time"
        return [
            *(BenchRow(f"new process: {part}", "ms", *spread(1e3 * found[part]), "kernels cached") for part in PROCESS),
            BenchRow(name, "ms", *spread(np.median(decided, axis=1)), told),
            self._of_naming(1e3 * found["naming"]),
            BenchRow(f"HapticSLAM.map_now after {seconds:g} s", "ms", *spread(asked), f"N = {self.size.few}"),
            BenchRow(f"a whole trial of {seconds:g} s, one core", "s", *spread(trial), note),
        ]

    def _of_naming(self, steps: Array) -> BenchRow:
        """Its mean: most steps wait for those that do the work."""
        told = (
            f"any turn, size and place unknown; 90 % below {np.percentile(steps, 90):.0f} ms, at most {steps.max():.0f}"
        )
        return BenchRow(f"naming, {len(self._among())} candidates", "ms", *spread(steps.mean(axis=1)), told)


def _slam(recording: BenchRecording, slam: HapticSLAM, threads: int | None, busy: bool = False) -> str:
    hand = recording.hand.name
    of = f"{slam.grid.shape[0]}³" if hand == "two_finger" else "MyoHand"
    said = "" if threads is None else f", {threads} thread{'s' if threads > 1 else ''}"
    return f"HapticSLAM.step, N = {slam.n_particles}, {of}{said}{', each core busy' if busy else ''}"
