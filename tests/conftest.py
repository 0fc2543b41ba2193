"""Where tests run side by side: each worker computes on one core, and what takes longest comes first."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator

import pytest

LONG = ("tests/scripts/", "tests/haptic_lab/")  # whole commands, and processes that are waited for

if "PYTEST_XDIST_WORKER" in os.environ:  # before NumPy, torch and OpenGL look: idle threads of theirs spin
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "LP_NUM_THREADS"):
        os.environ.setdefault(name, "1")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[object]:
    """What is collected stays: to look for garbage in it, now and later, takes a quarter of the time of collecting."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Each of two workers gets half of the tests, in order: half of the long files, then of the short ones. What one
    takes over from the other is of its end: so none waits long, nor makes anew what the tests of a file share."""
    names = [item.nodeid.partition("::")[0] for item in items]
    files = sorted(dict.fromkeys(names), key=lambda name: not name.startswith(LONG))
    place = {name: n for n, name in enumerate(files[::2] + files[1::2])}
    items.sort(key=lambda item: place[item.nodeid.partition("::")[0]])
