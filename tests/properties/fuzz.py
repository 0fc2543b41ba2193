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
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES, MINUTES, JOBS = 100_000, 30.0, 2
BATCH = 50  # inputs of an entry from one seed: what a signal ends, and what is drawn to come to a single one again
LONGEST = 20  # seconds that an input may take
HOPELESS = 3 * LONGEST  # after which a process that hangs in compiled code is ended
ROOM = 6 * 2**30  # bytes of address space above those at the start
SHOWN = 400  # characters of an input that are shown


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


def shown(arguments: Any) -> str:
    """`arguments` in one line."""
    try:
        with np.printoptions(threshold=6, edgeitems=1, precision=3):
            text = " ".join(repr(arguments).split())
    except Exception as error:  # of an int of thousands of digits
        text = f"<{error}>"
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def _try(entry: Any, arguments: Any) -> tuple[str, str]:
    """Kind and words of what comes of one input."""

    def ring(*_: object) -> None:
        raise Hang

    signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    try:
        return entry.try_with(arguments)
    except Hang:
        return f"takes more than {LONGEST} s", ""
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def child(area: str, share: int, seed: int, minutes: float, done: Mapping[str, int], log: IO[str]) -> None:
    """Run the inputs of `area`; each is announced before it runs, and what came of it follows. `done`: how many seeds of
    each entry an earlier process has used up."""
    from tests.properties.registry import AREAS

    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, used + ROOM))
    end, entries = time.monotonic() + 60 * minutes, AREAS[area]
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
                kind, told = _try(entry, arguments)
                log.write(json.dumps({"kind": kind, "told": told[:SHOWN]}) + "\n")
                if time.monotonic() > end:
                    log.write(json.dumps({"ended": True}) + "\n")
                    return
    log.write(json.dumps({"ended": True}) + "\n")


@dataclass
class Account:
    """What came of the inputs of an area: how many there were of each kind, and an example of each fault."""

    area: str
    kinds: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)
    entries: dict[str, set[str]] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def faults(self) -> dict[str, int]:
        """How often each fault happened."""
        return {kind: count for kind, count in self.kinds.most_common() if kind not in ("accepted", "refused")}

    def add(self, where: Mapping[str, Any], kind: str, told: str) -> None:
        """One more input, of the entry and the number that `where` says."""
        if kind in ("accepted", "refused"):
            self.kinds[kind] += 1
            return
        self.kinds[kind] += 1
        self.entries.setdefault(kind, set()).add(where["entry"])
        again = f"--again '{where['entry']}' {where['seed']}.{where['turn']}.{where['index']}"
        self.examples.setdefault(kind, f"{again}\n      {where['input']}\n      {told}")


def watch(area: str, share: int, seed: int, minutes: float, folder: Path) -> Account:
    """Run `area` in processes until all of its inputs are done: a new one after each that is ended by an input."""
    account, start, done, starts = Account(area), time.monotonic(), {}, 0
    while True:
        left = minutes - (time.monotonic() - start) / 60
        log = folder / f"{area}-{starts}.jsonl"
        told = {"area": area, "share": share, "seed": seed, "minutes": left, "done": done, "log": str(log)}
        with (folder / f"{area}-{starts}.err").open("w") as errors:
            process = subprocess.Popen(
                [sys.executable, "-m", "tests.properties.fuzz", "--child", json.dumps(told)],
                cwd=ROOT,
                stdout=subprocess.DEVNULL,
                stderr=errors,
            )
            _wait(process, log)
        ended, current = _read(log, account, done)
        starts += 1
        if not ended and current:
            crash = (folder / f"{area}-{starts - 1}.err").read_text(errors="replace")
            account.add(current, _death(process.returncode, crash), crash[-SHOWN:] if process.returncode > 0 else "")
        if ended or left <= 0.1 or starts > 500 or (not ended and not current):
            if not ended and not current:
                account.kinds["the fuzzer itself: did not start"] += 1
                account.examples["the fuzzer itself: did not start"] = log.with_suffix(".err").read_text()[-2000:]
            account.seconds = time.monotonic() - start
            return account


def _wait(process: subprocess.Popen[bytes], log: Path) -> None:
    """Until `process` has ended; it is ended where it writes nothing for long."""
    while True:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=5)
            return
        written = log.stat().st_mtime if log.exists() else time.time()
        if time.time() - written > HOPELESS + (120 if not log.exists() or log.stat().st_size == 0 else 0):
            process.send_signal(signal.SIGABRT)  # faulthandler then says where it was
            process.wait()
            return


def _read(log: Path, account: Account, done: dict[str, int]) -> tuple[bool, dict[str, Any]]:
    """Add what `log` says to `account`, and to `done`; whether it ended as it should, and the input under way."""
    where: dict[str, Any] = {}
    current: dict[str, Any] = {}
    for line in log.read_text().splitlines() if log.exists() else ():
        try:
            said = json.loads(line)
        except ValueError:  # the last one, cut off
            continue
        if "ended" in said:
            return True, {}
        if "entry" in said:
            where = said
            done[said["entry"]] = said["turn"] + 1
        elif "index" in said:
            current = {**where, **said}
        else:
            account.add(current, said["kind"], said["told"])
            current = {}
    return False, current


def _death(code: int, crash: str) -> str:
    """Of which kind an end by an input was."""
    if code == -signal.SIGABRT and "Fatal Python error: Aborted" in crash and "Current thread" in crash:
        kind = "hangs or aborts"
    else:
        kind = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit {code}"
    frame = re.search(r'File "[^"]*?((?:[\w.]+/)?[\w.]+)", line \d+ in (\w+)', crash)
    return f"{kind} at {frame[1]}:{frame[2]}" if frame else kind


def table(accounts: list[Account]) -> str:
    """What is printed in the end."""
    lines = [f"{'area':12} {'inputs':>8} {'accepted':>9} {'refused':>8} {'faults':>7} {'minutes':>8}"]
    for each in accounts:
        wrong = sum(each.faults.values())
        right, no = each.kinds["accepted"], each.kinds["refused"]
        lines.append(f"{each.area:12} {right + no + wrong:8} {right:9} {no:8} {wrong:7} {each.seconds / 60:8.1f}")
    total = [sum(sum(each.kinds.values()) for each in accounts), sum(sum(each.faults.values()) for each in accounts)]
    lines.append(f"{'all':12} {total[0]:8} {'':9} {'':8} {total[1]:7}")
    for each in accounts:
        for kind, count in each.faults.items():
            number = len(each.entries.get(kind, ()))
            of = f" ({number} entry points)" if number > 1 else ""
            lines.append(f"\n{count:6} × {each.area}: {kind}{of}\n      {each.examples[kind]}")
    return "\n".join(lines)


def run(examples: int, minutes: float, seed: int, areas: list[str], jobs: int, tell: Callable[[str], Any] = print) -> int:
    """All `areas`, `jobs` side by side; tells the table, and returns 1 where there is any fault."""
    from tests.properties.registry import AREAS

    weights = {area: sum(entry.weight for entry in AREAS[area].values()) for area in areas}
    total = sum(weights.values())
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder, ThreadPoolExecutor(jobs) as pool:
        share = minutes * jobs / len(areas)  # an area is one process
        runs = [
            pool.submit(watch, area, round(examples * weights[area] / total), seed, max(share, 0.5), Path(folder))
            for area in areas
        ]
        accounts = [each.result() for each in runs]
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
    print(*_try(entry, arguments), sep=": ")
    entry.call(**{key: put(value) for key, value in arguments.items()})
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--examples", type=int, default=int(os.environ.get("FUZZ_EXAMPLES", EXAMPLES)))
    parser.add_argument("--minutes", type=float, default=float(os.environ.get("FUZZ_MINUTES", MINUTES)))
    parser.add_argument("--jobs", type=int, default=int(os.environ.get("FUZZ_JOBS", JOBS)))
    parser.add_argument("--seed", type=int, default=int(os.environ.get("FUZZ_SEED", 0)))
    parser.add_argument("--areas", nargs="+")
    parser.add_argument("--again", nargs=2, metavar=("ENTRY", "SEED.TURN.INDEX"))
    parser.add_argument("--child", help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.child is not None:
        told = json.loads(given.child)
        with Path(told.pop("log")).open("w") as log:
            child(**told, log=log)
        return 0
    if given.again is not None:
        return again(*given.again)
    from tests.properties.registry import AREAS

    return run(given.examples, given.minutes, given.seed, given.areas or list(AREAS), given.jobs)


if __name__ == "__main__":
    sys.exit(main())
