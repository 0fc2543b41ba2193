"""Sweeps without processes: what a worker starts with takes longer than what most tests let it do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import pytest

from haptic_lab.commands import figures
from haptic_lab.commands.scheduling import SerialWorkers
from haptic_lab.sweeps import driver


@contextmanager
def in_this_process() -> Iterator[None]:
    """Whatever sweeps meanwhile works here, one call after the other."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (driver, figures):
            patch.setattr(module, "workers", lambda *_: nullcontext(SerialWorkers()))
        yield
