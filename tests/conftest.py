"""Where tests run side by side: each worker computes on one core, and what takes longest comes first."""

from __future__ import annotations

import gc
import os

import pytest

LONG = ("tests/scripts/", "tests/haptic_lab/")  # whole commands, and processes that are waited for

if "PYTEST_XDIST_WORKER" in os.environ:  # before NumPy, torch and OpenGL look: idle threads of theirs spin
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "LP_NUM_THREADS"):
        os.environ.setdefault(name, "1")


gc.disable()  # what is collected stays: to look for garbage in it takes a quarter of the time that it takes


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Short tests come last, so that no worker waits long for the other."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONG))
    gc.freeze()
    gc.enable()
