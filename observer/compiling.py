"""Sees to it that kernels are compiled before a trial begins, side by side in processes of their own.

What is compiled does not depend on the hand, and is kept (`haptic_env.kernel_cache`): it takes its time once for each
version of the code on each kind of processor. Observers ask for it at their first reset, so that nothing is compiled in
mid-trial.
"""

from __future__ import annotations

import hashlib
import importlib
import logging
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

from filelock import FileLock
from joblib import cpu_count
from numba.core import event
from numba.core.dispatcher import Dispatcher

from haptic_env import compiled, kernel_cache
from haptic_env.hand import Hand

Progress = Callable[[int, int], object]
LOG = logging.getLogger("haptic_slam")
USUAL = ("observer.warming:maps", "observer.warming:pose_and_hindsight")  # what an exploration usually needs
TOLD = "Compiling, once for this version on this machine; the observer's part takes some 20 s on two idle cores …"
CHILD = "import sys; from observer import compiling; compiling.compile_part(sys.argv[1])"
_ready: set[str] = set()  # parts that this process need not ask for
_compiles = False  # this process is one of those that compile


def ensure(parts: Collection[str], hand: Hand, progress: Progress | None = None) -> None:
    """See to it that parts of the code are compiled.

    Where no process can be started, functions are compiled when they are called.

    Args:
        parts: functions "module:name", each of which calls all that it needs for a hand.
        hand: the hand.
        progress: called with how many functions are done and how many there are; None: a line is logged where anything
            has to be compiled.
    """
    names = [name for name in parts if name not in _ready]
    if not names or _compiles:
        return
    marks = {name: _mark(name) for name in names}
    if not all(mark.exists() for mark in marks.values()):
        with FileLock(kernel_cache.folder() / "compiling.lock"):  # another process may be at it
            missing = [name for name, mark in marks.items() if not mark.exists()]
            if missing and sys.executable:
                if progress is None:
                    LOG.warning(TOLD)
                total, done = len(compiled.KERNELS), set[str]()
                for name in _compile(missing, hand):
                    if name in marks:
                        marks[name].touch()
                    elif progress is not None:
                        done.add(name)
                        progress(min(len(done), total), total)
                if progress is not None:
                    progress(total, total)
    _ready.update(names)


def _mark(part: str) -> Path:
    """The file that says that `part` is compiled, by the processor, what compiles, and all code that it may need."""
    package = part.partition(".")[0]
    told = hashlib.sha256(repr((kernel_cache.VERSIONS, kernel_cache.machine())).encode())
    for digest in sorted(kernel_cache.digest_of(kernel) for kernel in _kernels("haptic_env", "observer", package)):
        told.update(digest.encode())
    return kernel_cache.folder() / f"{part.replace(':', '.')}-{told.hexdigest()[:32]}.compiled"


def _kernels(*packages: str) -> list[Dispatcher]:
    return [each for each in compiled.KERNELS if each.py_func.__module__.partition(".")[0] in packages]


def _compile(parts: list[str], hand: Hand) -> Iterator[str]:
    """Compile `parts`, each in a process; the names of functions as they are done, and of a part when all of it is."""
    heard: SimpleQueue[str] = SimpleQueue()
    running: list[subprocess.Popen[bytes]] = []

    def listen(part: str) -> None:
        try:
            with subprocess.Popen(
                [sys.executable, "-P", "-c", CHILD, part],
                stdin=subprocess.PIPE,  # open as long as this process lives
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,  # what goes wrong there goes wrong here too, when the function is called
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            ) as child:
                running.append(child)
                assert child.stdin is not None
                assert child.stdout is not None
                pickle.dump(hand, child.stdin)
                child.stdin.flush()
                for line in child.stdout:
                    heard.put(line.decode().strip())
                if child.wait() == 0:
                    heard.put(part)
        finally:
            heard.put("")

    with ThreadPoolExecutor(min(len(parts), cpu_count())) as pool:
        for part in parts:
            pool.submit(listen, part)
        try:
            left = len(parts)
            while left:
                name = heard.get()
                left -= not name
                if name:
                    yield name
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in running:
                child.kill()


class _Reporter(event.Listener):
    """Tells of each function that was compiled."""

    def on_start(self, event: event.Event) -> None:
        pass

    def on_end(self, event: event.Event) -> None:
        function = event.data["dispatcher"].py_func
        print(f"{function.__module__}.{function.__qualname__}", flush=True)


def compile_part(part: str) -> None:
    """Compile one part, in a process of its own, which ends with the one that asked for it.

    Args:
        part: as of `ensure`; the hand comes by standard input.
    """
    global _compiles
    _compiles = True
    hand = pickle.load(sys.stdin.buffer)  # of the process that started this one
    # Not by `sys.stdin`, whose lock would be held when this process ends.
    threading.Thread(target=lambda: (os.read(sys.stdin.fileno(), 1), os._exit(1)), daemon=True).start()
    event.register("numba:compile", _Reporter())
    module, _, function = part.partition(":")
    getattr(importlib.import_module(module), function)(hand)
