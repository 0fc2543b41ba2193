"""The sweep on a real dask cluster: a scheduler and workers, each a process of its own, on loopback."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from haptic_env.extras import how_to_install
from haptic_lab.commands import evaluate
from haptic_lab.sweeps import cluster, provenance
from tests.haptic_lab.workers import in_this_process

pytest.importorskip("distributed")

ROOT = Path(__file__).resolve().parents[2]
TINY = [
    *("--shapes", "cube", "sphere", "--sigmas", "3", "--seconds", "0.5", "--particles", "5", "--exemplars", "1"),
    *("--observers", "floor", "haptic_slam", "--first-seed", "10", "--contact-false-alarm", "0", "0.02"),
    *("--classifiers", "nearest_neighbour"),
]
TRIALS = ["--trials", "5"]  # of each of two shapes and two noises


@contextmanager
def process(log: Path, *arguments: str) -> Iterator[subprocess.Popen]:
    """`python -m …`, away from the project's own folder; its end is the process's."""
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with log.open("wb") as file:
        run = subprocess.Popen(
            [sys.executable, "-m", *arguments], stdout=file, stderr=file, cwd=log.parent, env=variables
        )
    try:
        yield run
    finally:
        run.kill()
        run.wait()


@contextmanager
def worker(folder: Path, address: str, name: str, threads: int = 1) -> Iterator[subprocess.Popen]:
    """A worker that has joined the scheduler at `address`."""
    log, options = folder / f"{name}.log", ["--nthreads", str(threads), "--no-nanny", "--no-dashboard"]
    with process(log, "distributed.cli.dask_worker", address, *options) as run:
        wait_for(lambda: "Registered to" in log.read_text() or None)
        yield run


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a scheduler without workers."""
    folder = tmp_path_factory.mktemp("scheduler")
    file = folder / "scheduler.json"
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)]
    with process(folder / "scheduler.log", "distributed.cli.dask_scheduler", *options):
        yield wait_for(lambda: json.loads(file.read_text())["address"] if file.exists() else None)


@pytest.fixture(scope="module")
def one(scheduler: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of the scheduler, which has one worker."""
    with worker(tmp_path_factory.mktemp("one"), scheduler, "one"):
        yield scheduler


def wait_for(found):
    """What `found` returns once it is not nothing."""
    while True:
        with suppress(ValueError):  # a file that is being written
            if (result := found()) is not None:
                return result
        time.sleep(0.1)


def rows(folder: Path) -> int:
    table = folder / "trials.csv"
    return table.read_text().count("\n") - 1 if table.exists() else 0


def run(folder: Path, *arguments: str) -> int:
    return evaluate.main([*TINY, "--out", str(folder), *arguments])


def serially(folder: Path, *arguments: str) -> int:
    with in_this_process():
        return run(folder, *arguments)


def test_a_worker_is_killed_and_the_table_is_the_serial_one(one: str, tmp_path: Path) -> None:
    killed = []

    with worker(tmp_path, one, "lost") as lost:

        def kill() -> None:
            killed.append(wait_for(lambda: rows(tmp_path / "cluster") if rows(tmp_path / "cluster") >= 8 else None))
            lost.send_signal(signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        assert run(tmp_path / "cluster", *TRIALS, "--cluster", one) == 0
        killer.join()
        assert lost.wait() == -signal.SIGKILL
    assert 8 <= killed[0] < 32, "it was killed in the middle"
    assert serially(tmp_path / "serial", *TRIALS) == 0
    assert rows(tmp_path / "serial") == 2 * 2 * 5 * 2
    for name in ("trials.csv", "summary.csv", "config.json"):
        assert (tmp_path / "cluster" / name).read_bytes() == (tmp_path / "serial" / name).read_bytes()


def test_what_a_cluster_left_undone_this_machine_goes_on_with(
    one: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    quiet = ["--contact-false-alarm", "0"]
    assert run(tmp_path / "out", *quiet, "--trials", "1", "--cluster", one) == 0
    assert f"Run by the workers of {one} (1 now;" in capsys.readouterr().out
    assert serially(tmp_path / "out", *quiet, "--trials", "2") == 0
    assert run(tmp_path / "out", *quiet, "--trials", "2", "--cluster", "nobody:1") == 0, "nothing is left to do"
    assert serially(tmp_path / "serial", *quiet, "--trials", "2") == 0
    assert (tmp_path / "out" / "trials.csv").read_bytes() == (tmp_path / "serial" / "trials.csv").read_bytes()


def test_a_worker_of_several_threads_is_refused(scheduler: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    with worker(tmp_path, scheduler, "wide", threads=2):
        assert run(tmp_path / "out", "--trials", "1", "--cluster", scheduler) == 1
    assert "has 2 threads; start each with --nthreads 1" in " ".join(capsys.readouterr().out.split())


def test_a_worker_with_other_code_is_refused(
    one: str, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = provenance.signature()
    monkeypatch.setattr(cluster, "signature", lambda: {**mine, "code": "another"})
    assert run(tmp_path / "out", "--trials", "1", "--cluster", one) == 1
    told = " ".join(capsys.readouterr().out.split())
    assert f"would not give the same rows: code is {provenance.versions()['code']} there, another here" in told


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nowhere", "carrier-pigeon://here:1", ""])
def test_nobody_answers(
    address: str, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "SECONDS_TO_CONNECT", 0.5)
    assert run(tmp_path, "--trials", "1", "--cluster", address) == 1
    assert f"no dask scheduler answers at --cluster '{address}'" in " ".join(capsys.readouterr().out.split())


def test_who_listens_and_says_nothing_is_not_waited_for(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "SECONDS_TO_CONNECT", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        address = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        assert run(tmp_path, "--trials", "1", "--cluster", address) == 1
    told = " ".join(capsys.readouterr().out.split())
    assert f"no dask scheduler answers at --cluster '{address}'" in told
    assert "0.2 s" in told


def test_without_the_package_it_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(SystemExit) as ended:
        run(tmp_path, "--cluster", "tcp://127.0.0.1:9")
    assert ended.value.code == 2
    assert how_to_install("cluster") in capsys.readouterr().err
