"""Inputs by the hundred thousand against the rule: `make fuzz`, or by hand

    python -m tests.properties.fuzz --examples 1000 --areas observers
    python -m tests.properties.fuzz --again observer.HapticSLAM 0.3.17          one input once more

Each area runs in a process of its own, so that a signal, a hang or memory that runs out is the fault of an input and
not the end of the run. The same seed is the same inputs. Bounded by `--examples` for all areas together, and
`--minutes`.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import importlib
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

from tests.properties.accounts import ROOT, SHOWN, Account, death, shown, table

BATCH = 50  # inputs of an entry from one seed: what a signal ends, and what is drawn to come to a single one again
LONGEST = 60.0  # seconds that an input may take
HOPELESS = 2  # times that, after which a process that hangs in compiled code is ended
START = 120.0  # seconds that a process may take to begin
REGISTRY = "tests.properties.registry"
ROOM = 5 * 2**30  # bytes of address space above those at the start


@dataclass(frozen=True)
class Run:
    """How much is tried: `examples` of all areas, in so many `minutes` at most, by `jobs` processes, each input for as
    many seconds as the `longest` may take. Environment variables of these names, FUZZ_EXAMPLES, set them too."""

    examples: int = 100_000
    minutes: float = 30.0
    jobs: int = 2
    seed: int = 0
    longest: float = LONGEST
    registry: str = REGISTRY


class Hang(BaseException):
    """An input that takes too long; no `Exception`, which somebody might catch."""


def inputs_of(name: str, entry: Any, seed: int, turn: int = 0, count: int = BATCH) -> list[Any]:
    """`count` inputs at most, the same for the same `seed` and `turn`, and others for each entry."""
    from hypothesis import HealthCheck, Phase, Verbosity, given, settings
    from hypothesis import seed as seeded

    drawn: list[Any] = []

    @seeded(zlib.crc32(f"{name} {seed} {turn}".encode()))
    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        verbosity=Verbosity.quiet,
        suppress_health_check=list(HealthCheck),
    )
    @given(entry.inputs)
    def draw(arguments: Any) -> None:
        drawn.append(arguments)

    draw()
    return drawn


def _try(entry: Any, arguments: Any, longest: float) -> tuple[str, str]:
    """Kind and words of what comes of one input, which may take so many seconds."""

    def ring(*_: object) -> None:
        raise Hang

    signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, longest)
    try:
        return entry.try_with(arguments)
    except Hang:
        return f"takes more than {longest:g} s", ""
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def limit_memory() -> None:
    """Let this process have `ROOM` more than it has, so that what asks for all there is gets none of it."""
    if sys.platform == "linux":
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, hard))


def child(run: Run, area: str, share: int, minutes: float, done: Mapping[str, int], log: IO[str]) -> None:
    """Run `share` inputs of `area`; each is announced before it runs, and what came of it follows. `done`: how many
    batches of each entry an earlier process has used up."""
    seed, registry = run.seed, importlib.import_module(run.registry)
    faulthandler.enable()
    registry.prepare(area)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    limit_memory()
    end, entries = time.monotonic() + 60 * minutes, registry.AREAS[area]
    total = sum(entry.weight for entry in entries.values())
    batches = {name: max(1, round(share * entry.weight / total / BATCH)) for name, entry in entries.items()}
    for turn in range(max(batches.values())):
        for name, entry in entries.items():
            if not done.get(name, 0) <= turn < batches[name]:
                continue
            log.write(json.dumps({"entry": name, "turn": turn, "seed": seed}) + "\n")
            for index, arguments in enumerate(inputs_of(name, entry, seed, turn)):
                log.write(json.dumps({"index": index, "input": shown(arguments)}) + "\n")
                log.flush()
                kind, told = _try(entry, arguments, run.longest)
                log.write(json.dumps({"kind": kind, "told": told[:SHOWN]}) + "\n")
                if time.monotonic() > end:
                    log.write(json.dumps({"ended": True}) + "\n")
                    return
    log.write(json.dumps({"ended": True}) + "\n")


def watch(run: Run, area: str, share: int, end: float, folder: Path) -> Account:
    """Run `area` in processes until all of its inputs are done, or until `end`: a new one after each that is ended by
    an input."""
    account, start, starts = Account(area), time.monotonic(), 0
    done: dict[str, int] = {}
    while True:
        left = max((end - time.monotonic()) / 60, 0.0)
        log = folder / f"{area}-{starts}.jsonl"
        told = {"run": asdict(run), "area": area, "share": share, "minutes": left, "done": done, "log": str(log)}
        with (folder / f"{area}-{starts}.err").open("w") as errors:
            process = subprocess.Popen(
                [sys.executable, "-m", "tests.properties.fuzz", "--child", json.dumps(told)],
                cwd=ROOT,
                stdout=subprocess.DEVNULL,
                stderr=errors,
            )
            _wait(process, log, HOPELESS * run.longest)
        ended, current = account.read(log, done)
        starts += 1
        if not ended and current:
            crash = (folder / f"{area}-{starts - 1}.err").read_text(errors="replace")
            account.add(current, death(process.returncode, crash), crash[-SHOWN:] if process.returncode > 0 else "")
        if ended or left <= 0.1 or starts > 500 or (not ended and not current):
            if not ended and not current:
                account.kinds["the fuzzer itself: did not start"] += 1
                account.examples["the fuzzer itself: did not start"] = log.with_suffix(".err").read_text()[-2000:]
            account.seconds = time.monotonic() - start
            return account


def _wait(process: subprocess.Popen[bytes], log: Path, hopeless: float) -> None:
    """Until `process` has ended; it is ended where it writes nothing for so many seconds."""
    start = time.time()
    while True:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=2)
            return
        begun = log.exists() and log.stat().st_size > 0
        silent = time.time() - (log.stat().st_mtime if begun else start)
        if silent > hopeless + (0.0 if begun else START):
            process.send_signal(signal.SIGABRT)  # faulthandler then says where it was
            process.wait()
            return


def fuzz(run: Run, areas: Sequence[str] = (), tell: Callable[[str], Any] = print) -> int:
    """Run `areas`, all where there is none; tells the table, and returns 1 where there is any fault."""
    weights = {
        area: sum(entry.weight for entry in entries.values())
        for area, entries in importlib.import_module(run.registry).AREAS.items()
        if not areas or area in areas
    }
    end = time.monotonic() + 60 * run.minutes
    largest_first = sorted(weights.items(), key=lambda each: -each[1])
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder, ThreadPoolExecutor(run.jobs) as pool:
        watched = [
            pool.submit(watch, run, area, round(run.examples * weight / sum(weights.values())), end, Path(folder))
            for area, weight in largest_first
        ]
        accounts = [each.result() for each in watched]
    tell(table(accounts))
    return int(any(each.faults for each in accounts))


def again(name: str, which: str) -> int:
    """One input once more, with its whole traceback; `which`: its seed, turn and index."""
    from tests.properties.files import put
    from tests.properties.registry import ENTRIES

    entry = ENTRIES[name]
    seed, turn, index = map(int, which.split("."))
    arguments = inputs_of(name, entry, seed, turn)[index]
    print(shown(arguments))
    faulthandler.enable()
    print(*_try(entry, arguments, LONGEST), sep=": ")
    entry.call(**{key: put(value) for key, value in arguments.items()})
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, value in asdict(Run()).items():
        usual = type(value)(os.environ.get(f"FUZZ_{name.upper()}", value))
        parser.add_argument(f"--{name}", type=type(value), default=usual)
    parser.add_argument("--areas", nargs="+", default=[])
    parser.add_argument("--again", nargs=2, metavar=("ENTRY", "SEED.TURN.INDEX"))
    parser.add_argument("--child", help=argparse.SUPPRESS)
    given = vars(parser.parse_args(arguments))
    told, areas, once = given.pop("child"), given.pop("areas"), given.pop("again")
    if told is not None:
        how = json.loads(told)
        with Path(how.pop("log")).open("w") as log:
            child(**{**how, "run": Run(**how["run"])}, log=log)
        return 0
    return fuzz(Run(**given), areas) if once is None else again(*once)


if __name__ == "__main__":
    sys.exit(main())
