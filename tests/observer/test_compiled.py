"""Kernels in forked processes, where threads are dead."""

from __future__ import annotations

import multiprocessing

import numba
import numpy as np
import pytest

from observer.compiled import parallel


@parallel(cache=True)
def _squares(values):
    result = np.empty(len(values))
    for i in numba.prange(len(values)):
        result[i] = values[i] ** 2
    return result


def _send(connection, values) -> None:
    connection.send_bytes(_squares(values).tobytes())


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no process is forked here")
@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")  # of Python 3.12
def test_a_forked_process_computes_the_same_without_threads(both_numbers_of_threads):
    """The parent has run threads before, so that a child that asked for them would hang or die."""
    numba.set_num_threads(max(both_numbers_of_threads))
    values = np.random.default_rng(0).standard_normal(1000)
    expected = _squares(values).tobytes()
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(target=_send, args=(theirs, values), daemon=True)
    child.start()
    try:
        assert ours.poll(60.0), "the child has no answer"
        assert ours.recv_bytes() == expected
        child.join(60.0)
        assert child.exitcode == 0
    finally:
        child.kill()
