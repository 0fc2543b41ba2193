"""Where the work of a sweep is done: in processes of this machine, or by the workers of a dask cluster."""

from __future__ import annotations

import gc
import multiprocessing
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from haptic_lab.processes import deaf, end_with_parent
from haptic_lab.sweeps.cluster import cluster_workers
from haptic_lab.sweeps.workers import Call, Workers, WorkersLostError, limit_threads

MOST_ON_WINDOWS = 61  # processes that it lets another one wait for


def workers(jobs: int, cluster: str | None) -> AbstractContextManager[Workers]:
    """Find who runs the calls.

    Args:
        jobs: processes of this machine.
        cluster: address of a dask scheduler, to ask in place of these.

    Returns:
        The workers, within a context.
    """
    return local_workers(jobs) if cluster is None else cluster_workers(cluster)


@contextmanager
def local_workers(jobs: int) -> Iterator[Workers]:
    """Start processes; where anything goes wrong, Ctrl-C included, they end at once, and so they do where this process
    ends, however it does.

    Args:
        jobs: how many.

    Yields:
        The workers.
    """
    if sys.platform == "win32":
        jobs = min(jobs, MOST_ON_WINDOWS)
    executor = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), _prepare)
    try:
        yield LocalWorkers(executor, jobs)
        executor.shutdown()
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()
        raise


class LocalWorkers:
    """Processes of this machine."""

    def __init__(self, executor: Executor, jobs: int) -> None:
        """Take processes that are there.

        Args:
            executor: that runs them.
            jobs: how many there are.
        """
        self._executor, self._ahead = executor, 4 * jobs
        self.told = f"{jobs} processes of this machine" if jobs > 1 else "a process of this machine"

    def share(self, value: Any) -> Any:
        """Share nothing: a call has its own copy.

        Args:
            value: for calls.

        Returns:
            The same.
        """
        return value

    def run(self, work: Callable[..., Any], calls: Iterable[Call]) -> Iterator[Any]:
        """Run calls, as `Workers.run`.

        Args:
            work: what is called.
            calls: arguments of each call.

        Yields:
            What each returns.

        Raises:
            WorkersLostError: where a process died.
        """
        waiting, under_way = iter(calls), set[Future[Any]]()
        try:
            while True:
                room = self._ahead - len(under_way)
                with deaf():
                    under_way |= {self._executor.submit(work, *call) for call in islice(waiting, room)}
                if not under_way:
                    return
                done, under_way = wait(under_way, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        except BrokenProcessPool as error:
            raise WorkersLostError("a worker died (out of memory?)") from error


def stamped(place: str, work: Callable[..., Any], *call: Any) -> Any:
    """Call something, and add a line to a file: when it began and ended, what it took of the processor, and what the
    whole process took meanwhile, in seconds.

    Args:
        place: path of the file.
        work: what is called.
        *call: its arguments.

    Returns:
        What it returns.
    """
    clocks = time.perf_counter, time.thread_time, time.process_time
    begin = [clock() for clock in clocks]
    result = work(*call)
    end = [clock() for clock in clocks]
    with Path(place).open("a", encoding="utf-8") as file:
        print(begin[0], end[0], *(b - a for a, b in zip(begin[1:], end[1:], strict=True)), file=file)
    return result


def _prepare() -> None:
    """Ctrl-C is the business of whoever started the process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    gc.freeze()  # what was imported stays: to look through it for garbage took 1.5 % of the time
    limit_threads()
