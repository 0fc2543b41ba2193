"""Processes that work for another one end with it, and Ctrl-C is that one's business."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TREE = """
import multiprocessing, os, signal, sys, time
from concurrent.futures import ProcessPoolExecutor

def work(how):
    os.write(1, b"working\\n")
    while how == "busy":
        pass
    time.sleep(10**6)

def plain(arguments):
    from haptic_lab.processes import end_with_parent
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # which nohup ignores, and its children with it
    pool = ProcessPoolExecutor(2, multiprocessing.get_context("spawn"), end_with_parent)
    for each in [pool.submit(work, each) for each in arguments]:
        each.result()

def sweep(arguments):
    from haptic_lab.sweeps.executors import local_workers
    with local_workers(2) as team:
        for _ in team.run(work, [(each,) for each in arguments]):
            pass

if __name__ == "__main__":
    globals()[sys.argv[1]](sys.argv[2:])
"""
ARGUMENTS = [
    *("--shapes", "cube", "--sigmas", "3", "--trials", "100000", "--seconds", "0.1", "--observers", "floor"),
    *("--classifiers", "--jobs", "2"),
]


@contextmanager
def start(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A command in a group of processes of its own, as a terminal starts it; what it starts has its output too."""
    with subprocess.Popen(
        [sys.executable, "-u", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"},
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


@pytest.mark.parametrize(
    ("tree", "how"),
    [("plain", signal.SIGKILL), ("plain", signal.SIGTERM), ("plain", signal.SIGHUP), ("sweep", signal.SIGKILL)],
)
def test_workers_end_with_their_parent_however_it_dies(tmp_path: Path, tree: str, how: signal.Signals) -> None:
    """Its output comes to an end when the last of them has ended, and not before."""
    (tmp_path / "tree.py").write_text(TREE, encoding="utf-8")
    with start(str(tmp_path / "tree.py"), tree, "busy", "asleep") as parent:
        assert parent.stdout is not None
        assert [parent.stdout.readline() for _ in range(2)] == ["working\n", "working\n"]
        parent.send_signal(how)
        assert parent.wait() == -how
        assert "Traceback" not in parent.stdout.read()


def test_ctrl_c_at_a_terminal_ends_workers_that_are_being_started_quietly(tmp_path: Path) -> None:
    """A terminal sends it to the whole group. When the command has its own modules, who loads them is a worker."""
    script = str(ROOT / "scripts" / "evaluate.py")
    with start("-X", "importtime", script, *ARGUMENTS, "--out", str(tmp_path)) as sweep:
        assert sweep.stdout is not None
        assert any("Run by" in line for line in iter(sweep.stdout.readline, ""))
        assert any("numpy" in line for line in iter(sweep.stdout.readline, ""))
        os.killpg(sweep.pid, signal.SIGINT)
        told = sweep.stdout.read()
    assert "Traceback" not in told
    assert "Stopped; every finished trial is kept" in told
    assert sweep.returncode == 130


@pytest.mark.parametrize("command", ["evaluate.py", "figures.py", "explore.py"])
def test_ctrl_c_while_modules_are_loaded_ends_a_command_quietly(tmp_path: Path, command: str) -> None:
    with start("-X", "importtime", str(ROOT / "scripts" / command), "--out", str(tmp_path / "out")) as process:
        assert process.stdout is not None
        assert any("numpy" in line for line in iter(process.stdout.readline, ""))
        os.killpg(process.pid, signal.SIGINT)
        assert "Traceback" not in process.stdout.read()
    assert process.returncode == -signal.SIGINT
    assert not (tmp_path / "out").exists()


DEAF = """
import multiprocessing
import signal

from haptic_lab.processes import deaf


def heard(pipe):
    pipe.send(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, set()))


if __name__ == "__main__":
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=heard, args=(theirs,))
    with deaf():
        process.start()
    print(ours.recv(), signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, set()))
    process.join()
"""


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="Windows has no masks of signals")
def test_the_first_process_that_is_spawned_is_deaf(tmp_path: Path) -> None:
    """Python starts a process of its own before it, and hears signals again after that."""
    script = tmp_path / "first.py"
    script.write_text(DEAF)
    told = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True, timeout=60)
    assert told.stdout.split() == ["True", "False"]
