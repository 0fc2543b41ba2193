"""Work on several threads: all of it, once, in any process, and errors come back."""

from __future__ import annotations

import multiprocessing

import numpy as np
import pytest

from haptic_env.compiled import kernel
from observer import threads


@kernel()
def _squares(begin, end, values, out):
    for i in range(begin, end):
        out[i] += values[i] ** 2


def _squared(values, number):
    out = np.zeros(len(values))
    threads.run(_squares, len(values), number, values, out)
    return out


@pytest.mark.parametrize("number", [1, 2, 3, 64])
@pytest.mark.parametrize("size", [0, 1, 2, 7, 1000])
def test_every_part_is_done_once(number, size):
    values = np.random.default_rng(0).standard_normal(size)
    assert _squared(values, number).tobytes() == (values**2).tobytes()


def _send(connection, values) -> None:
    connection.send_bytes(_squared(values, 3).tobytes())


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no process is forked here")
@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")  # of Python 3.12
def test_a_forked_process_has_threads_of_its_own():
    """Those of the parent do not live on in it: to wait for them would be to hang."""
    values = np.arange(1000.0)
    expected = _squared(values, 3).tobytes()
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


def test_an_error_comes_back():
    def work(begin, end):
        if begin > 0:
            raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        threads.run(work, 100, 2)


def test_how_many(monkeypatch):
    monkeypatch.setattr(threads, "cpu_count", lambda: 4)
    monkeypatch.setattr(threads, "_most", None)  # whatever an earlier test has bounded
    assert [threads.chosen(None, work, 100.0) for work in (0, 99, 100, 150, 1000)] == [1, 1, 2, 3, 4]
    assert threads.chosen(7, 1, 100.0) == 7
    assert threads.limit(2) is None
    assert threads.chosen(None, 1000, 100.0) == 2
    assert threads.chosen(3, 1000, 100.0) == 3
    assert threads.limit(None) == 2


@pytest.mark.parametrize("wrong", [0, -1, 1.5, "2", True, 5000])
def test_a_wrong_number_is_refused(wrong):
    with pytest.raises(ValueError, match=r"threads must be an integer"):
        threads.check(wrong)
