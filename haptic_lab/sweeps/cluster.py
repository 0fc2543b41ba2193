"""The workers of a dask cluster: they share no disk with this machine, and are to run the same code."""

from __future__ import annotations

import asyncio
import logging
import pickle
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from typing import Any

from haptic_lab.sweeps.provenance import signature
from haptic_lab.sweeps.workers import Call, Workers, WorkersLostError, limit_threads

SECONDS_TO_CONNECT = 5
AHEAD = 2000  # calls that wait at a scheduler: enough for many workers, and little to keep
THREADS = "start each with --nthreads 1, one for each core (docs/clusters.md)"


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
    limit_threads()
    return work(*call)
