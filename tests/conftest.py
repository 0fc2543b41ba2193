"""Where tests run side by side: each worker computes on one core, and what takes longest comes first."""

from __future__ import annotations

import gc
import os
from collections import Counter
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


@pytest.hookimpl(trylast=True)  # of what -m and -k left
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Each of two workers gets half of the tests, in order: half of the long files, then as many short ones as make it
    half of all. What one takes over from the other is of its end: so none waits long, nor makes anew what the tests of
    a file share."""
    tests = Counter(item.nodeid.partition("::")[0] for item in items)
    long = [name for name in tests if name.startswith(LONG)]
    halves = long[::2], long[1::2]
    for name in sorted(tests.keys() - {*long}, key=lambda name: (-tests[name], name)):  # what is small fills up
        min(halves, key=lambda half: sum(tests[each] for each in half)).append(name)
    place = {name: n for n, name in enumerate(halves[0] + halves[1])}
    items.sort(key=lambda item: place[item.nodeid.partition("::")[0]])
