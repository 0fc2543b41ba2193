"""Where the work of a sweep is done: in processes of this machine, or by the workers of a dask cluster.

Both have `share`, for what many calls need, and `run`. A worker is one core's work and runs one call at a time.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import multiprocessing
import pickle
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Protocol

from threadpoolctl import threadpool_limits

from haptic_lab.processes import deaf, end_with_parent
from haptic_lab.sweeps.provenance import signature
from observer import threads

SECONDS_TO_CONNECT = 5
AHEAD = 2000  # calls that wait at a scheduler: enough for many workers, and little to keep
THREADS = "start each with --nthreads 1, one for each core (docs/clusters.md)"
Call = tuple[Any, ...]


class WorkersLostError(Exception):
    """Who worked is gone; the message says what may have happened."""


class Workers(Protocol):
    """Who runs the calls.

    Attributes:
        told: says it, in words.
    """

    @property
    def told(self) -> str: ...

    def share(self, value: Any) -> Any:
        """Send once what many calls need.

        Args:
            value: that they need.

        Returns:
            What stands for it among the arguments of calls.
        """

    def run(self, work: Callable[..., Any], calls: Iterable[Call]) -> Iterator[Any]:
        """Run calls.

        Args:
            work: what is called, and importable where it runs.
            calls: arguments of each call.

        Returns:
            What each call returns, in the order in which they finish. It raises what `work` raises, `WorkersLostError`,
            and `ValueError` for a worker that must not take part.
        """


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


@contextmanager
def cluster_workers(address: str) -> Iterator[Workers]:
    """Ask the workers of a dask scheduler, those of now and later ones; they stay when this ends.

    Args:
        address: of the scheduler.

    Yields:
        The workers.

    Raises:
        ValueError: where no scheduler answers.
    """
    import distributed
    from distributed.utils import silence_logging_cmgr

    with silence_logging_cmgr(logging.CRITICAL):  # what goes wrong is told here, in one line
        try:
            asyncio.run(_knock(address))
            client = distributed.Client(address, timeout=SECONDS_TO_CONNECT, name="haptic-slam")
        except Exception as error:  # anything at all may answer there
            told = str(error) or f"no handshake within {SECONDS_TO_CONNECT} s"
            raise ValueError(f"no dask scheduler answers at --cluster {address!r} ({told})") from error
        try:
            yield ClusterWorkers(client)
        finally:
            client.close()


class ClusterWorkers:
    """Workers that share no disk with this machine. A call whose worker is lost is run again by another one.

    All that is sent is pickled here, so that the scheduler need not know this project.
    """

    def __init__(self, client: Any) -> None:
        """Take a client that is connected.

        Args:
            client: of dask.
        """
        self._client = client
        count = len(client.scheduler_info(n_workers=-1)["workers"])
        self.told = f"the workers of {client.scheduler.address} ({count} now; further ones may join)"

    def share(self, value: Any) -> Any:
        """Send once what many calls need; it is handed from worker to worker, and made again when it is lost.

        Args:
            value: that is pickled.

        Returns:
            A future of it.
        """
        return self._client.submit(bytes, pickle.dumps(value), pure=False)

    def run(self, work: Callable[..., Any], calls: Iterable[Call]) -> Iterator[Any]:
        """Run calls, as `Workers.run`.

        Args:
            work: what is called.
            calls: arguments of each call, which are pickled.

        Yields:
            What each returns.

        Raises:
            WorkersLostError: where the connection is lost, or worker after worker died.
            ValueError: for a worker that cannot import what it must run.
        """
        import distributed

        waiting, checked, carry = iter(calls), partial(_checked, signature(), work), _carrier()

        def submit(count: int) -> list[Any]:
            sent = [
                [each if isinstance(each, distributed.Future) else pickle.dumps(each) for each in (checked, *call)]
                for call in islice(waiting, count)
            ]
            return [self._client.submit(carry, *each, pure=False) for each in sent]

        under_way = distributed.as_completed(submit(AHEAD))
        try:
            for future in under_way:
                yield future.result()
                under_way.update(submit(1))
        except distributed.KilledWorker as error:
            raise WorkersLostError("worker after worker died of the same trial (out of memory?)") from error
        except distributed.CancelledError as error:
            raise WorkersLostError("the connection to the scheduler is lost") from error
        except ImportError as error:
            raise ValueError(
                f"a worker cannot import what it must run ({error}): install this project there from the same "
                "checkout with pip install -e (docs/clusters.md)"
            ) from error


async def _knock(address: str) -> None:
    """Raises where no dask scheduler answers. A client alone would wait for a handshake for ever."""
    import distributed
    from distributed.comm.core import connect

    async with asyncio.timeout(SECONDS_TO_CONNECT):
        secrets = distributed.Security().get_connection_args("client")
        comm = await connect(address, timeout=SECONDS_TO_CONNECT, **secrets)
        comm.abort()


def _carrier() -> Callable[..., Any]:
    """What runs pickled work in a worker."""

    # A function within a function is itself sent whole, not by its name, so that nothing of this project need be
    # importable before it runs.
    def carry(*pickled: bytes) -> Any:
        import pickle

        work, *call = [pickle.loads(each) for each in pickled]
        return work(*call)

    return carry


def _checked(expected: dict[str, str], work: Callable[..., Any], *call: Any) -> Any:
    """Runs in a worker of a cluster: `work`, if it would come out as on the machine that `expected` is from."""
    import distributed

    worker = distributed.get_worker()
    if worker.state.nthreads != 1:
        raise ValueError(f"the worker {worker.address} has {worker.state.nthreads} threads; {THREADS}")
    found = signature()
    other = [f"{name} is {found[name]} there, {here} here" for name, here in expected.items() if found[name] != here]
    if other:
        raise ValueError(f"the worker {worker.address} would not give the same rows: {'; '.join(other)}")
    _limit_threads()
    return work(*call)


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
    _limit_threads()


def _limit_threads() -> None:
    threads.limit(1)
    threadpool_limits(1)
