"""What a sweep costs beyond its trials: the same trials in a bare loop, through a process of this machine as
evaluate.py --jobs 1 runs them, and through the one worker of a dask cluster as evaluate.py --cluster does.

"between" is how long the worker was without a trial from one to the next; "beside" what the worker's process took of
the processor beside each trial, which is dask's own threads; "here" the processor time, for each trial, of the process
that hands them out and writes the table, of the cluster also its scheduler's (the bare loop has it between its trials).
"cost" is what is taken from the cores of trials, as a share of a trial's processor time: the first two, and without a
cluster also the third. "start" is what passes once, before the first trial, which is not counted. All three must write
the same table. Workers of the cluster are started as docs/clusters.md does.
"""

from __future__ import annotations

import argparse
import logging
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from haptic_env import validate
from haptic_lab.files import write_csv
from haptic_lab.folder_lock import claimed
from haptic_lab.sweeps import options
from haptic_lab.sweeps.cluster import cluster_workers
from haptic_lab.sweeps.driver import sweep
from haptic_lab.sweeps.executors import stamped, workers
from haptic_lab.sweeps.worker import run_trials
from haptic_lab.sweeps.workers import Workers
from haptic_lab.terminal import Parser, as_path

EXAMPLE = "example: haptic-slam scheduling --trials 10 --out out/scheduling"
FIRST_SEED = 45_000
LOOP, PROCESS, CLUSTER = "bare loop", "process, --jobs 1", "dask worker, --cluster"
COLUMNS = {  # and how each is shown
    "trials": "{:.0f}",
    "trial_ms": "{:.0f}",
    "trial_cpu_ms": "{:.0f}",
    "between_ms": "{:.2f}",
    "beside_ms": "{:.2f}",
    "here_ms": "{:.2f}",
    "cost_percent": "{:.2f} %",
    "start_s": "{:.1f}",
}


class SerialWorkers:
    """`Workers` that are this process: one call after the other."""

    told = "a loop"

    def share(self, value: Any) -> Any:
        """Share nothing: calls are in this process.

        Args:
            value: for calls.

        Returns:
            The same.
        """
        return value

    def run(self, work: Callable[..., Any], calls: Iterable[tuple[Any, ...]]) -> Iterator[Any]:
        """Run calls one after the other.

        Args:
            work: what is called.
            calls: arguments of each call.

        Returns:
            What each returns, one after the other.
        """
        return (work(*call) for call in calls)


@contextmanager
def cluster_of_one() -> Iterator[Workers]:
    """Start a dask cluster on this machine with one worker of one thread.

    Yields:
        Its workers.
    """
    import dask
    import distributed

    one: dict[str, Any] = {"n_workers": 1, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": ":0"}
    quiet: dict[str, Any] = {"silence_logs": logging.CRITICAL, "env": {"DASK_LOGGING__DISTRIBUTED": "critical"}}
    with (
        dask.config.set({"distributed.worker.profile.enabled": False}),
        distributed.LocalCluster(**one, **quiet) as cluster,
        cluster_workers(cluster.scheduler_address) as team,
    ):
        yield team


WAYS: dict[str, Callable[[], AbstractContextManager[Workers]]] = {
    LOOP: lambda: nullcontext(SerialWorkers()),
    PROCESS: lambda: workers(1, None),
    CLUSTER: cluster_of_one,
}


def measure(way: str, flags: list[str], folder: Path) -> tuple[dict[str, float], bytes]:
    """Run a sweep in one way, and time it.

    Args:
        way: one of `WAYS`.
        flags: of `haptic-slam evaluate`.
        folder: for the results.

    Returns:
        The columns of `COLUMNS`, and the table as bytes.
    """
    stamps = folder / "stamps"
    plan, results = options.parse(None, [*flags, "--out", str(folder)])
    work, began = partial(stamped, str(stamps), run_trials), time.perf_counter()
    with WAYS[way]() as team:
        used = time.process_time()
        sweep(plan, results, Console(quiet=True), work, nullcontext(team))
        used = time.process_time() - used
    results.rewrite()
    begin, end, own, process = np.loadtxt(stamps, ndmin=2).T
    trial, beside = 1e3 * own[1:].mean(), 1e3 * (process - own)[1:].mean()
    between = 1e3 * (begin[1:] - end[:-1]).mean()
    here = 0.0 if way == LOOP else 1e3 * used / len(begin)
    told = {
        "trials": len(begin) - 1,
        "trial_ms": 1e3 * (end - begin)[1:].mean(),
        "trial_cpu_ms": trial,
        "between_ms": between,
        "beside_ms": beside,
        "here_ms": here,
        "cost_percent": 100 * (between + beside + (0.0 if way == CLUSTER else here)) / trial,
        "start_s": begin[0] - began,
    }
    return told, results.path.read_bytes()


def compare(flags: list[str], console: Console) -> pd.DataFrame:
    """Run a sweep in each of `WAYS`.

    Args:
        flags: of `haptic-slam evaluate`.
        console: says how far it is.

    Returns:
        A row for each way.

    Raises:
        ValueError: where they do not write the same table.
    """
    rows, tables = [], set()
    with tempfile.TemporaryDirectory() as root:
        source = Path(root, "source")
        with console.status("exemplars …"):
            measure(LOOP, [*flags, "--trials", "1"], source)
        for number, way in enumerate(WAYS):
            folder = Path(root, str(number))
            shutil.copytree(source / "exemplars", folder / "exemplars")
            with console.status(f"{way} …"):
                row, table = measure(way, flags, folder)
            rows.append({"way": way, **row})
            tables.add(table)
    if len(tables) > 1:
        raise ValueError("the tables are not the same bits")
    return pd.DataFrame(rows)


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--trials", type=int, default=10, help="explorations for each of the four shapes (default 10)")
    add("--quick", action="store_true", help="two short trials of few particles: to see that it runs")
    place = "where to write (default out/scheduling)"
    add("--out", type=as_path, metavar="FOLDER", default="out/scheduling", help=place)
    given = parser.parse_args(arguments)
    try:
        trials = validate.integer("--trials", given.trials, 1, 10_000)
    except ValueError as error:
        parser.error(str(error))
    flags = ["--sigmas", "3", "--first-seed", str(FIRST_SEED), "--trials", str(trials)]
    flags += ["--observers", "floor", "haptic_slam", "ceiling"]
    if given.quick:
        flags += ["--shapes", "cube", "sphere", "--trials", "1", "--seconds", "1", "--particles", "5"]
    console = Console(width=None if sys.stdout.isatty() else 120)
    out = Path(given.out)
    with claimed(out, ("scheduling.csv",)):
        rows = compare(flags, console)
        table = Table("", *(name.replace("_", " ") for name in COLUMNS))
        for row in rows.to_dict("records"):
            table.add_row(row["way"], *(form.format(row[name]) for name, form in COLUMNS.items()))
        console.print(table)
        write_csv(out / "scheduling.csv", rows)
        console.print(f"Written: {out}/scheduling.csv", highlight=False)
    return 0
